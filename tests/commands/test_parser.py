"""Command lines from dataclasses."""

from dataclasses import KW_ONLY, dataclass, field
from pathlib import Path
from typing import Literal

import pytest

from dnf_pyg.commands import COMMANDS
from dnf_pyg.commands.options import DenoiseOptions, PredictOptions
from dnf_pyg.commands.parser import option_parser, parse_options, summary
from dnf_pyg.commands.view_options import ViewOptions
from dnf_pyg.errors import OptionError
from dnf_pyg.options import FAST, FilterOptions, UpdateOptions, expert

NAMES = {"one": 1, "two": 2}


@dataclass(frozen=True)
class Inner:
    """Inner options.

    Args:
        size: Size of it.
        hidden: Not on the command line.
    """

    size: int = expert(5)
    hidden: int = 7


@dataclass(frozen=True)
class Outer:
    """Do a thing. And more.

    Examples:
        program in.obj --small

    All of it.

    Args:
        paths: Files, 100% of them.
        output: Where to.
        small: A little.
        names: Some names.
        mode: How.
        share: How much.
    """

    paths: tuple[Path, ...]
    _: KW_ONLY
    output: Path
    small: bool = field(default=False, metadata={"preset": {"size": 1, "share": 0.5}})
    names: tuple[str, ...] = field(default=("one",), metadata={"choices": f"{__name__}:NAMES", "metavar": "NAME"})
    mode: Literal["fast", "slow"] = "fast"
    share: float | None = None
    inner: Inner = field(default=Inner(), metadata={"skip": ("hidden",)})


@pytest.fixture(autouse=True)
def importable(monkeypatch):
    """Choices are named by import path; under pytest's import mode this file has none."""
    monkeypatch.setattr("dnf_pyg.commands.parser.resolve_name", lambda path: NAMES)


def parse(*words):
    return parse_options(option_parser(Outer, "program"), Outer, words)[0]


def test_values_defaults_and_types():
    assert parse("a", "b", "-o", "c") == Outer((Path("a"), Path("b")), output=Path("c"))
    words = ["--small", "--names", "one", "two", "--mode", "slow", "--share", "0.5"]
    found = parse("a", "--output", "c", *words)
    assert found == Outer((Path("a"),), output=Path("c"), small=True, names=("one", "two"), mode="slow", share=0.5,
                          inner=Inner(size=1))  # fmt: skip


def test_what_is_given_goes_before_a_preset():
    found = parse("a", "-o", "c", "--size", "9", "--small")
    assert (found.inner.size, found.share) == (9, 0.5)


def test_config_file_has_the_same_names(tmp_path):
    (tmp_path / "some.yaml").write_text("size: 3\nnames: [two]\nsmall: true\n")
    found = parse("a", "-o", "c", "-c", str(tmp_path / "some.yaml"))
    assert (found.inner.size, found.names, found.small) == (3, ("two",), True)
    assert parse("a", "-o", "c", "-c", str(tmp_path / "some.yaml"), "--size", "4").inner.size == 4


@pytest.mark.parametrize(
    ("words", "text"),
    [
        (["a", "-o", "c", "--smal"], r"^Expected an option of `program` \(got --smal\). Did you mean --small\?$"),
        (["a", "-o", "c", "--hidden", "1"], r"\(got --hidden\). See `program --help`"),
        (["a"], r"Expected a value for .*output \(got none\)"),
        (["-o", "c"], r"Expected a value for paths \(got none\)"),
        (["a", "-o", "c", "--size"], r"Expected a value for --size \(got none\)"),
        (
            ["a", "-o", "c", "--size", "2.5"],
            r"^Expected 'size' to be a whole number \(got 2.5\). See `prog.* --help`.$",
        ),
        (["a", "-o", "c", "--share", "half"], r"'share' to be a number \(got half\)"),
        (["a", "-o", "c", "--names", "one", "six"], r"'names' to be one of one, two \(got six\)"),
        (["a", "-o", "c", "--mode", "mid"], r"'mode' to be one of fast, slow \(got mid\)"),
        (["", "-o", "c"], r"Expected no empty words"),
        (
            ["a", "-o", "c", "-c", "\udcff.yaml"],
            r"^Expected 'config' in UTF-8 \(got other bytes\). Give .* in UTF-8. See `prog",
        ),
        (["a", "-o", "c", "-c", "absent.yaml"], r"absent.yaml"),
    ],
)
def test_wrong_words(words, text):
    with pytest.raises(OptionError, match=text) as caught:
        parse(*words)
    assert "\n" not in str(caught.value)


def test_choice_that_begins_with_a_dash():
    for words in (["--view", "-x"], ["--view=-x"]):
        parser = option_parser(ViewOptions, "view")
        assert parse_options(parser, ViewOptions, ["a.ply", *words])[0].view == "-x"
    with pytest.raises(OptionError, match="Expected a value for --view"):
        parse_options(option_parser(ViewOptions, "view"), ViewOptions, ["a.ply", "--view", "-o"])


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("paths: a.ply", r"^Expected 'paths' to be a list \(got one str\). Write it in brackets.$"),
        ("paths: [3]", r"'paths' to be a path \(got 3\)"),
        ("output: [c]", r"'output' to be a path \(got \['c'\]\)"),
        ("names: [3]", r"'names' to be a text \(got 3\)"),
        ("share: half", r"'share' to be a number \(got half\)"),
    ],
)
def test_wrong_values_in_a_config_file(tmp_path, text, reason):
    (tmp_path / "some.yaml").write_text(text)
    with pytest.raises(OptionError, match=reason):
        parse("a", "-o", "c", "-c", str(tmp_path / "some.yaml"))


def test_names_that_are_not_utf8():
    found = parse("a\udcff", "\udcff", "-o", "\udcfe.ply")
    assert (found.paths, found.output) == ((Path("a\udcff"), Path("\udcff")), Path("\udcfe.ply"))


def test_unknown_key_in_a_config_file(tmp_path):
    (tmp_path / "some.yaml").write_text("sise: 3\n")
    with pytest.raises(OptionError, match="sise"):
        parse("a", "-o", "c", "-c", str(tmp_path / "some.yaml"))


def test_help_has_examples_first_and_two_groups():
    text = option_parser(Outer, "program").format_help()
    parts = ["usage: program PATHS [PATHS ...] [OPTIONS]", "Do a thing", "examples:\n  program in.obj --small",
             "Files, 100% of them.", "everyday options:", "A little.", "One of one, two. Default: one.",
             "One of fast, slow. Default: fast.", "expert options:", "Size of it. Default: 5.", "--config"]  # fmt: skip
    flat = " ".join(text.split())
    places = [flat.index(" ".join(part.split())) for part in parts]
    assert places == sorted(places)
    assert "hidden" not in text


@pytest.mark.parametrize("name", COMMANDS)
def test_every_option_of_every_command_is_explained(name):
    parser = option_parser(COMMANDS[name].options, f"dnf-pyg {name}")
    for action in parser._actions:
        assert action.help, f"{name} {action.dest}"
        assert "-" not in action.dest
    assert summary(COMMANDS[name].options)
    assert f"dnf-pyg {name.split()[0]}" in parser.format_help()


def parse_denoise(*words):
    return parse_options(option_parser(DenoiseOptions, "dnf-pyg denoise"), DenoiseOptions, ["a.obj", *words])[0]


def test_options_of_denoise():
    assert (parse_denoise().filtering, parse_denoise().update) == (FilterOptions(), UpdateOptions())
    found = parse_denoise("--strength", "0.5", "--preserve_boundary", "--growth", "heat", "--k", "1", "2", "3")
    assert found.update == UpdateOptions(strength=0.5, preserve_boundary=True)
    assert found.filtering == FilterOptions(growth="heat", k=(1, 2, 3))
    assert parse_denoise("--fast").filtering == FAST
    assert [parse_denoise(*words).weights for words in ([], ["--fast"], ["--fast", "--weights", "best"])] == [
        "best", "small", "best",
    ]  # fmt: skip
    assert parse_denoise("--fast", "--coverage", "3").filtering == FilterOptions(coverage=3, k=FAST.k)
    assert parse_denoise("--max_move", "inf").update == UpdateOptions()


@pytest.mark.parametrize(
    ("words", "text"),
    [
        (["--strength", "2"], r"'strength' to be a number from 0 to 1 \(got 2.0\)"),
        (["--num_passes", "0"], r"'num_passes' to be a whole number of at least 1 \(got 0\)"),
        (["--max_move", "-1"], r"'max_move' to be a number of at least 0 \(got -1.0\)"),
        (["--max_move", "nan"], r"'max_move' to be a number of at least 0 \(got nan\)"),
        (["--threads", "0"], r"'threads' to be a whole number of at least 1 \(got 0\)"),
        (["--iterations", "3"], r"Did you mean --num_iterations\?"),
        (["--max-move", "3"], r"Did you mean --max_move\?"),
    ],
)
def test_wrong_options_of_denoise(words, text):
    with pytest.raises(OptionError, match=text):
        parse_denoise(*words)


def test_predict_leaves_the_device_to_the_trainer():
    with pytest.raises(OptionError, match="--device"):
        parse_options(option_parser(PredictOptions, "p"), PredictOptions, ["a", "-o", "b", "--device", "cuda"])
