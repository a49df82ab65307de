"""Command lines made from dataclasses: names, types, defaults and help come from their fields and docstrings."""

import argparse
import dataclasses
import difflib
import re
import textwrap
import types
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from pkgutil import resolve_name
from typing import Any, Literal, TypeVar, get_args, get_origin, get_type_hints

from docstring_parser import DocstringStyle, parse
from jsonargparse import ArgumentParser, Namespace

from dnf_pyg.commands.reasons import reason_of
from dnf_pyg.errors import OptionError

__all__ = ["option_parser", "parse_options", "summary"]

T = TypeVar("T")

_SHORT = {"output": "-o"}
_NOUNS = {int: "a whole number", float: "a number", bool: "true or false", Path: "a path", str: "a text"}


def option_parser(kind: type, prog: str) -> ArgumentParser:
    """Make the parser of a command.

    Fields before ``KW_ONLY`` are positional, the others options; those of a dataclass inside it are options, too, under
    their own names. A field may say more in its metadata: ``expert``, ``choices`` (the import path of a mapping with
    the names to choose from), ``preset`` (options by name whose values a flag makes the defaults), and ``skip`` (names
    of inner fields that are no options).

    Args:
        kind: Dataclass whose docstring describes the command and its fields.
        prog: Name of the command, such as ``dnf-pyg denoise``.
    """
    fields = list(_fields(kind))
    words = [_usage(field, hint) for field, hint, _, positional in fields if positional]
    parser = ArgumentParser(
        prog=prog,
        usage=" ".join([prog, *words, "[OPTIONS]"]),
        description=_description(kind),
        formatter_class=_HelpFormatter,
        exit_on_error=False,
        default_env=False,
        allow_abbrev=False,
    )
    everyday, expert = parser.add_argument_group("everyday options"), parser.add_argument_group("expert options")
    for field, hint, text, positional in fields:
        group = parser if positional else expert if field.metadata.get("expert") else everyday
        flags = [field.name] if positional else [*filter(None, [_SHORT.get(field.name)]), f"--{field.name}"]
        group.add_argument(*flags, **_argument(field, hint, text, positional))
    expert.add_argument("-c", "--config", action="config", help="YAML file with any of these options")
    return parser


def parse_options(parser: ArgumentParser, kind: type[T], words: Sequence[str]) -> tuple[T, Namespace]:
    """Parse the words of a command line.

    Args:
        parser: Parser from :func:`option_parser`, to which other arguments may have been added.
        kind: The dataclass that it was made from.
        words: Words after the name of the command.

    Returns:
        The dataclass, and the values of all arguments.

    Raises:
        OptionError: If an option is unknown, missing or out of its range.
    """
    if "" in words:
        raise OptionError("Expected no empty words (got ''). Check the variables that the shell replaces.")
    words = _joined(words, kind)
    try:
        found = parser.parse_args(words)
        for field, *_ in _fields(kind):
            if "preset" in field.metadata and found[field.name]:
                preset = field.metadata["preset"]
                parser.set_defaults({name: _default(value) for name, value in preset.items() if name in found})
                found = parser.parse_args(words)
    except argparse.ArgumentError as error:
        raise OptionError(_reason(error, parser, kind)) from error
    return _build(kind, found), found


def _joined(words: Sequence[str], kind: type) -> list[str]:
    """Write a choice that begins with a dash as argparse takes it: ``--view=-x`` for ``--view -x``."""
    choices = {f"--{field.name}": get_args(_element(hint)) for field, hint, *_ in _fields(kind)}
    joined: list[str] = []
    for word in words:
        if joined and word.startswith("-") and word in choices.get(joined[-1], ()):
            joined[-1] += f"={word}"
        else:
            joined.append(word)
    return joined


class _HelpFormatter(argparse.RawDescriptionHelpFormatter):
    """Replaces the import path of a mapping by its names, so that it is imported only when the help is shown."""

    def _get_help_string(self, action: argparse.Action) -> str:
        return re.sub(r"<([\w.]+:\w+)>", lambda path: ", ".join(resolve_name(path[1])), action.help or "")


def summary(kind: type) -> str:
    """First sentence of the docstring of a command."""
    return (parse(kind.__doc__ or "").short_description or "").rstrip(".")


def _fields(kind: Any, inner: bool = False) -> Iterator[tuple[dataclasses.Field, Any, str, bool]]:
    """Fields of a dataclass and of those inside it: type, description, and whether it is positional."""
    hints = get_type_hints(kind)
    texts = {
        parameter.arg_name: parameter.description or ""
        for base in reversed(kind.__mro__)
        for parameter in parse(base.__doc__ or "", DocstringStyle.GOOGLE).params
    }
    for field in dataclasses.fields(kind):
        hint = hints[field.name]
        if dataclasses.is_dataclass(hint):
            skipped = field.metadata.get("skip", ())
            yield from (found for found in _fields(hint, inner=True) if found[0].name not in skipped)
        else:
            yield field, hint, " ".join(texts[field.name].split()), not (inner or field.kw_only)


def _build(kind: type[T], found: Namespace) -> T:
    """Make the dataclass from the values of its options."""
    hints, values = get_type_hints(kind), {}
    for field in dataclasses.fields(kind):  # type: ignore[arg-type]
        if dataclasses.is_dataclass(hints[field.name]):
            values[field.name] = _build(hints[field.name], found)
        elif field.name in found:
            value = found[field.name]
            values[field.name] = tuple(value) if isinstance(value, list) else value
            _check_choices(field, values[field.name])
    return kind(**values)


def _check_choices(field: dataclasses.Field, value: Any) -> None:
    if "choices" not in field.metadata or value == field.default:
        return
    known = list(resolve_name(field.metadata["choices"]))
    for name in value if isinstance(value, tuple) else (value,):
        if name not in known:
            raise OptionError(
                f"Expected '{field.name}' to be one of {', '.join(known)} (got {name}). Choose one of these."
            )


def _argument(field: dataclasses.Field, hint: Any, text: str, positional: bool) -> dict[str, Any]:
    """Arguments of ``add_argument`` for a field."""
    kind = _element(hint)
    required = field.default is dataclasses.MISSING
    if get_origin(kind) is Literal:
        text += f" One of {', '.join(get_args(kind))}."
    if "choices" in field.metadata:
        text += f" One of <{field.metadata['choices']}>."
    if not required and field.default is not False and field.default not in (None, (), float("inf")):
        text += f" Default: {' '.join(field.default) if isinstance(field.default, tuple) else field.default}."
    if kind is bool:
        return {"action": "store_true", "help": text}
    kind = _READERS.get(kind, kind)
    options: dict[str, Any] = {"type": kind, "help": text.replace("%", "%%"), "metavar": _metavar(field)}
    if not required:
        options["default"] = _default(field.default)
    elif not positional:
        options["required"] = True
    if _is_many(hint):
        options["nargs"] = "+" if required else "*"
    elif positional and not required:
        options["nargs"] = "?"
    return options


def _number(value: Any) -> float:
    """Read a number; jsonargparse reads words as YAML, which does not know infinity."""
    try:
        return float(value)
    except (TypeError, ValueError) as error:
        raise ValueError(f"Got value: {value}") from error


def _path(value: Any) -> Path:
    """Read a path; YAML has no bytes that are not UTF-8, as names of files may have."""
    return Path(_text(value))


def _text(value: Any) -> str:
    """Read a text, which may be a path, too; one of a config file may be anything else."""
    if not isinstance(value, str | Path):
        raise ValueError(f"Got value: {value}")
    return str(value)


_READERS: dict[Any, Callable[[Any], Any]] = {float: _number, Path: _path, str: _text}


def _default(value: Any) -> Any:
    """Default in the form that jsonargparse takes, which fills lists in place."""
    return list(value) if isinstance(value, tuple) else value


def _element(hint: Any) -> Any:
    """Type of one value: without ``None``, and of the elements of a tuple."""
    kind = get_args(hint)[0] if isinstance(hint, types.UnionType) else hint  # of ``kind | None``
    return get_args(kind)[0] if get_origin(kind) is tuple else kind


def _is_many(hint: Any) -> bool:
    return tuple in (get_origin(hint), *map(get_origin, get_args(hint)))


def _metavar(field: dataclasses.Field) -> str:
    return str(field.metadata.get("metavar", field.name.upper()))


def _usage(field: dataclasses.Field, hint: Any) -> str:
    """A positional argument in the usage line."""
    name = _metavar(field)
    if _is_many(hint):
        return f"{name} [{name} ...]"
    return name if field.default is dataclasses.MISSING else f"[{name}]"


def _description(kind: type) -> str:
    """Summary, examples, and the rest of the docstring of a command."""
    text = parse(kind.__doc__ or "", DocstringStyle.GOOGLE)
    examples = [example.description or "" for example in text.examples]
    shown = [f"examples:\n{textwrap.indent(example, '  ')}" for example in examples]
    return "\n\n".join(filter(None, [text.short_description, *shown, text.long_description]))


def _reason(error: argparse.ArgumentError, parser: ArgumentParser, kind: type) -> str:
    """Describe a parsing error in one line."""
    help_hint = f"See `{parser.prog} --help`."
    message = " ".join(str(error).split())
    if single := re.search(r"Parser key \"(\w+)\".* '(\w+)' object (?:is not iterable|does not support item)", message):
        return f"Expected '{single[1]}' to be a list (got one {single[2]}). Write it in brackets."
    if unknown := re.search(r"unrecognized arguments: (-[^\s=]*)", message):
        known = [f"--{name}" for name in [*parser.get_defaults().keys(), "help"]]
        near = difflib.get_close_matches(unknown[1].replace("-", "_").replace("__", "--", 1), known, n=1)
        remedy = f"Did you mean {near[0]}?" if near else help_hint
        return f"Expected an option of `{parser.prog}` (got {unknown[1]}). {remedy}"
    if missing := re.search(r"are required: (.*)|argument (.*): expected (?:one|at least one) argument", message):
        return f"Expected a value for {missing[1] or missing[2]} (got none). {help_hint}"
    wrong = re.search(r'Parser key "(\w+)".*(?:Got|Given) value: (.*)', message)
    if wrong := wrong or re.search(r"argument --(\w+): invalid _number value: '(.*)'", message):
        for field, hint, *_ in _fields(kind):
            if field.name == wrong[1]:
                element = _element(hint)
                choices = get_args(element) if get_origin(element) is Literal else ()
                noun = f"one of {', '.join(choices)}" if choices else _NOUNS.get(element, f"a {element}")
                return f"Expected '{wrong[1]}' to be {noun} (got {wrong[2]}). {help_hint}"
    reason = reason_of(error)
    return (
        f"{reason}. {help_hint}"
        if reason.startswith("Expected")
        else f"Expected options of `{parser.prog}` (got: {reason}). {help_hint}"
    )
