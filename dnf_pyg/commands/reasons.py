"""What is wrong with the arguments of a command or with a config, in one sentence."""

import inspect
import re
from argparse import ArgumentError
from pkgutil import resolve_name

from dnf_pyg.commands.class_policy import PACKAGES

__all__ = ["reason_of"]


def reason_of(error: ArgumentError) -> str:
    r"""Describe an error of jsonargparse, whose text names a key on each level, and the value on the deepest.

    Args:
        error: What was raised.

    Returns:
        A sentence without its full stop; the text of the error where it is of another form.

    Example:
        >>> reason_of(ArgumentError(None, "Parser key \"seed\": Expected a <class 'int'>. Got value: x"))
        "Expected 'seed' to be int (got x)"
    """
    text = " ".join(str(error).split())
    if denied := re.search(r"Importing '([\w.]+)' is not allowed", text):
        return (
            f"Expected classes of {', '.join(PACKAGES)} or of modules allowed by --allow_class (got '{denied[1]}'). "
            f"Add `--allow_class {denied[1].partition('.')[0]}` if you trust it"
        )
    keys = re.findall(r'Parser key "([\w.]+)":', text)
    if keys and "surrogates not allowed" in text:
        return f"Expected '{'.'.join(keys)}' in UTF-8 (got other bytes). Give the file or folder a name in UTF-8"
    if unknown := re.search(r"class_path '([\w.]+)': Option '([\w.]+)' is not accepted", text):
        known = ", ".join(inspect.signature(resolve_name(unknown[1])).parameters)
        return f"Expected an argument of {unknown[1].rpartition('.')[2]}: {known} (got '{unknown[2]}')"
    deepest = text.rpartition('Parser key "')[2]
    kinds = re.search(r"Subtypes: \[(.*?)\] Errors:|Expected an? (.*?)\. (?:Got|Given)", deepest)
    value = re.search(r"(?:Got|Given) value: (.*?)(?= - Expected| Given value|$)", deepest)
    if keys and kinds and value and "class_path" not in deepest:
        return f"Expected '{'.'.join(keys)}' to be {_plain(kinds[1] or kinds[2])} (got {value[1]})"
    return text.rstrip(".")


def _plain(kinds: str) -> str:
    """Types as Python writes them, without what says nothing to a user."""
    kinds = re.sub(r"<class '(?:[\w.]+\.)?(\w+)'>", r"\1", kinds).replace("NoneType", "null")
    return re.sub(r"typing\.Literal\[(.*?)\]", lambda literal: literal[1].replace("'", ""), kinds)
