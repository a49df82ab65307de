"""The command ``dnf-pyg``: training and prediction through Lightning, and the mesh commands."""

import argparse
import io
import os
import sys
import warnings
from collections.abc import Sequence
from typing import Any, NoReturn

import dnf_pyg
from dnf_pyg.commands import COMMANDS, LIGHTNING
from dnf_pyg.errors import DNFError, MeshFileWarning

__all__ = ["main"]


def main(args: Sequence[str] | None = None) -> int:
    """Run one command line.

    Args:
        args: Words after ``dnf-pyg``; those of the process if not given.

    Returns:
        The exit status: 0, or 2 after one line on stderr for bad input.

    Example:
        >>> main(["configs", "nonesuch"])  # one line on stderr
        2
    """
    words = list(sys.argv[1:] if args is None else args)
    if sys.stdout is None:  # closed by the caller
        sys.stdout = io.StringIO()
    with warnings.catch_warnings():
        warnings.simplefilter("always", MeshFileWarning)
        warnings.showwarning = _show_warning  # type: ignore[assignment]
        return _run(words)


def _run(words: list[str]) -> int:
    """Run one command line and turn what is wrong with it into a line on stderr and a status."""
    try:
        if words and words[0] in LIGHTNING:
            LIGHTNING[words[0]][0].run(words)
        else:
            options = _parser().parse_args(words or ["--help"])
            options.run(options)
        sys.stdout.flush()  # a reader that has gone is noticed here, not at exit
    except DNFError as error:
        sys.stderr.write(f"dnf-pyg: {' '.join(str(error).split())}\n")
        return 2
    except KeyboardInterrupt:
        sys.stderr.write("dnf-pyg: interrupted\n")
        return 130
    except BrokenPipeError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())  # what is left to write goes nowhere
        return 141
    return 0


def _show_warning(message: Warning | str, category: type[Warning], *where: Any) -> None:
    """Print a warning of ours as one line, and any other with its place in the source."""
    ours = issubclass(category, MeshFileWarning)
    sys.stderr.write(f"warning: {message}\n" if ours else warnings.formatwarning(message, category, *where[:2]))


class _Parser(argparse.ArgumentParser):
    """Parser that tells a wrong word in one line, as all other bad input is told."""

    def error(self, message: str) -> NoReturn:
        raise DNFError(f"{message}: see `{self.prog} --help`")


def _parser() -> argparse.ArgumentParser:
    parser = _Parser(
        prog="dnf-pyg",
        description=dnf_pyg.__doc__,
        epilog="`dnf-pyg COMMAND --help` tells more.",
    )
    parser.add_argument("--version", action="version", version=dnf_pyg.__version__)
    subparsers = parser.add_subparsers(metavar="COMMAND [OPTIONS]", required=True)
    for name, (module, summary) in COMMANDS.items():
        subparser = subparsers.add_parser(name, help=summary, description=module.__doc__)
        module.add_arguments(subparser)
        subparser.set_defaults(run=module.run)
    for name, (_, summary) in LIGHTNING.items():  # listed here, parsed by Lightning
        subparsers.add_parser(name, help=summary, add_help=False)
    return parser
