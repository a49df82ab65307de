"""Which classes a config may name: those of a few packages, and of modules that the command line allows."""

import argparse
from collections.abc import Sequence

from jsonargparse import set_parsing_settings

from dnf_pyg.errors import DataError

__all__ = ["HOW", "PACKAGES", "restrict_classes"]

PACKAGES = ("dnf_pyg", "lightning", "torch", "torch_geometric")
HOW = (
    f"A config may name classes of {', '.join(PACKAGES)}. Those of other modules need --allow_class MODULE on the "
    "command line, once for each module. A config is code: run only those that you trust."
)


def restrict_classes(words: Sequence[str]) -> list[str]:
    """Refuse class paths outside the packages that configs need, before anything is imported for them.

    Args:
        words: Words of the command line; each ``--allow_class MODULE`` among them allows one more module.

    Returns:
        The other words.

    Raises:
        DataError: If a module is missing or not the name of one.
    """
    parser = argparse.ArgumentParser(add_help=False, allow_abbrev=False, exit_on_error=False)
    parser.add_argument("--allow_class", action="append", default=[])
    try:
        options, rest = parser.parse_known_args(list(words))
        set_parsing_settings(import_path_denylist=["*"], import_path_allowlist=[*PACKAGES, *options.allow_class])
    except (argparse.ArgumentError, ValueError) as error:
        raise DataError(f"Expected --allow_class with the name of a module (got {error}). Give one.") from error
    return rest
