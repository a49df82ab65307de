import io
import sys

import pytest

from dnf_pyg.commands.terminal import printable, tell


@pytest.mark.parametrize(
    ("text", "shown"),
    [
        ("plain name, é θ 猫", "plain name, é θ 猫"),
        ("\x1b]0;title\x07\x1b[31m", r"\x1b]0;title\x07\x1b[31m"),
        ("a\nb\tc\rd", r"a\nb\tc\rd"),
        ("\u202egnp.obj", r"\u202egnp.obj"),  # turns what follows round
        ("\udcff.obj", r"\udcff.obj"),  # a byte of a file name that is no text
        ("\x9b2J", r"\x9b2J"),
    ],
)
def test_control_characters_are_escaped(text, shown):
    assert printable(text) == shown


def test_what_the_terminal_cannot_encode_is_escaped():
    assert printable("é θ 猫", "latin-1") == "é \\u03b8 \\u732b"
    raw = io.BytesIO()
    terminal = io.TextIOWrapper(raw, encoding="ascii")
    tell("θ", "b\x1b", file=terminal)
    assert raw.getvalue() == b"\\u03b8\nb\\x1b\n"


def test_lines_go_to_stdout_by_default(capsys, monkeypatch):
    tell("a", 1)
    assert capsys.readouterr().out == "a\n1\n"
    monkeypatch.setattr(sys, "stdout", io.StringIO())  # has no encoding
    tell("θ")
    assert sys.stdout.getvalue() == "θ\n"
