"""The command line program ``dnf-pyg``."""

import difflib
import gc
import io
import os
import sys
import warnings
from collections.abc import Callable, Sequence
from importlib.util import find_spec
from pkgutil import resolve_name
from typing import Any, TextIO

import dnf_pyg
from dnf_pyg.commands import COMMANDS, LIGHTNING
from dnf_pyg.commands.parser import option_parser, parse_options, summary
from dnf_pyg.commands.terminal import tell
from dnf_pyg.errors import DenoiseWarning, DNFError, MeshFileWarning, OptionError

__all__ = ["main"]

_EXAMPLES = """\
examples:
  dnf-pyg demo
  dnf-pyg denoise noisy.obj
  dnf-pyg denoise scans -o denoised --fast
  dnf-pyg compare noisy_denoised.obj clean.obj
"""


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
    os.environ.setdefault("GOMP_SPINCOUNT", "30000")  # let idle OpenMP threads sleep instead of busy-waiting
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", DenoiseWarning)  # commands report them themselves, with the mesh
            warnings.simplefilter("always", MeshFileWarning)
            warnings.showwarning = _show_warning
            _run(words)
        sys.stdout.flush()  # a reader that has gone is noticed here, not at exit
    except DNFError as error:
        tell(f"dnf-pyg: {' '.join(str(error).split())}", file=sys.stderr)
        return 2
    except KeyboardInterrupt:
        tell("dnf-pyg: interrupted", file=sys.stderr)
        return 130
    except BrokenPipeError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())  # what is left to write goes nowhere
        return 141
    return 0


def _run(words: list[str]) -> None:
    if not words or words[0] in ("-h", "--help"):
        tell(*_overview().splitlines())
    elif words[0] in ("-V", "--version"):
        tell(dnf_pyg.__version__)
    elif words[0] in LIGHTNING:
        if words in (["fit"], ["validate"], ["test"]):
            raise OptionError(
                f"Expected -c CONFIG after `dnf-pyg {words[0]}` (got nothing). `dnf-pyg configs` lists the packaged "
                "configs."
            )
        _check_installed(words[0], "lightning", "train")
        _imported(LIGHTNING[words[0]][0])(words)
    else:
        name = next((name for name in (" ".join(words[:2]), words[0]) if name in COMMANDS), None)
        if name is None:
            _run_group(words)
            return
        command = COMMANDS[name]
        parser = option_parser(command.options, f"dnf-pyg {name}")
        options, _ = parse_options(parser, command.options, words[len(name.split()) :])
        if command.needs is not None:
            _check_installed(name, *command.needs)
        _imported(command.work)(options)


def _imported(path: str) -> Callable[[Any], None]:
    """Import what a command does, without looking for garbage meanwhile.

    The modules of torch and PyG stay until the end, and looking through them again and again takes a quarter of the
    time. Frozen, they are left out later, too.
    """
    enabled = gc.isenabled()
    gc.disable()
    try:
        work: Callable[[Any], None] = resolve_name(path)
        if gc.get_freeze_count() == 0:  # once, also where Python code calls this many times
            gc.freeze()
    finally:
        if enabled:
            gc.enable()
    return work


def _check_installed(command: str, package: str, extra: str) -> None:
    if find_spec(package) is None:
        raise OptionError(
            f"Expected {package.capitalize()} for `dnf-pyg {command}` (got none in this environment). Install dnf-pyg "
            f'with its extra "{extra}", in a checkout by `pip install ".[{extra}]"`.'
        )


def _run_group(words: Sequence[str]) -> None:
    """Show the commands of a group such as ``experiment``.

    Raises:
        OptionError: If there is no such command.
    """
    group = [name for name in COMMANDS if name.startswith(f"{words[0]} ")]
    if group and words[1:] in ([], ["-h"], ["--help"]):
        tell(f"usage: dnf-pyg {words[0]} COMMAND [OPTIONS]", "", "commands:", *_list(group))
        return
    known = group or [*LIGHTNING, *COMMANDS]
    given = " ".join(words[: 1 + bool(group)])
    near = difflib.get_close_matches(given, known, n=1)
    remedy = f"Did you mean `dnf-pyg {near[0]}`?" if near else "See `dnf-pyg --help`."
    raise OptionError(f"Expected a command (got '{given}'). {remedy}")


def _overview() -> str:
    """Text of ``dnf-pyg --help``."""
    lines = [
        "usage: dnf-pyg COMMAND [OPTIONS]",
        f"\n{dnf_pyg.__doc__}\n\n{_EXAMPLES}",
        "commands:",
        *_list([*COMMANDS, *LIGHTNING]),
        "\n`dnf-pyg COMMAND --help` lists the options of a command; `dnf-pyg -V` prints the version.",
    ]
    return "\n".join(lines)


def _list(names: Sequence[str]) -> list[str]:
    texts = {name: LIGHTNING[name][1] if name in LIGHTNING else summary(COMMANDS[name].options) for name in names}
    return [f"    {name:<21} {text}" for name, text in texts.items()]


def _show_warning(
    message: Warning | str, category: type[Warning], filename: str, lineno: int, file: TextIO | None = None,
    line: str | None = None,
) -> None:  # fmt: skip
    """Show a warning in one line; where it comes from matters only for those of other packages."""
    origin = "" if category.__module__.startswith("dnf_pyg") else f"{filename}:{lineno}: {category.__name__}: "
    tell(f"warning: {origin}{' '.join(str(message).split())}", file=file or sys.stderr)
