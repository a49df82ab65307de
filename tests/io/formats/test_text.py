import numpy as np
import pytest

from dnf_pyg.io.formats.document import UnsupportedError
from dnf_pyg.io.formats.text import check_text, number_text, parse_numbers, replace_tokens


@pytest.mark.parametrize(
    ("data", "reason", "remedy"),
    [
        ("v 0 0 0\n".encode("utf-16"), "UTF-16", "Save it as UTF-8."),
        ("v 0 0 0\n".encode("utf-16-be"), "UTF-16", "Save it as UTF-8."),
        ("v 0 0 0\n".encode("utf-16-le"), "UTF-16", "Save it as UTF-8."),
        (b"v 0 0 0\rv 1 0 0\r", "carriage returns alone", "Convert them to line feeds."),
    ],
)
def test_text_that_has_to_be_converted_first(data, reason, remedy):
    with pytest.raises(UnsupportedError, match=reason) as raised:
        check_text(data)
    assert raised.value.remedy == remedy


def test_usual_text_is_taken():
    for data in (b"", b"v", b"v 0 0 0\r\n", b"\xef\xbb\xbfv 0 0 0\n", b"\0\0\0"):
        check_text(data)


def test_decimal_comma_is_named():
    np.testing.assert_array_equal(parse_numbers([b"1", b"-2.5e3"], 2), [[1, -2500]])
    with pytest.raises(UnsupportedError, match="'-0,5'"):
        parse_numbers([b"1", b"-0,5"], 2)
    with pytest.raises(ValueError, match="could not convert"):
        parse_numbers([b"1", b"one,5"], 2)


@pytest.mark.parametrize(
    ("used", "own", "text"),
    [
        ([[0.0], [100.0]], [], b"0.12345679"),
        ([[0.0], [0.01]], [], b"0.123456789012"),
        ([[0.0], [1e9]], [], b"0.1"),
        ([[0.0], [1e9]], [b"0.123456"], b"0.123457"),  # as fine as the file, whatever the extent
        ([[0.0], [1e9]], [b"1.25e-4", b"7"], b"0.123457"),
        ([[0.0], [1.0]], [b"1e-300"], b"0.12345678901234566"),  # no more than float64 holds
        ([[np.nan], [0.0], [100.0]], [b"nan"], b"0.12345679"),
        (np.empty((0, 1)), [], b"0.1234567890"),
    ],
)
def test_digits(used, own, text):
    assert number_text(np.array([[0.12345678901234567]]), np.array(used), own) == [[text]]


def test_replaces_words_and_keeps_blanks():
    for line, written in (
        (b"v 1 2 3", b"v 7 8 9"),
        (b"  v\t1  2 3\r", b"  v\t7  8 9\r"),
        (b"v 1 \\\n 2 3", b"v 7 \\\n 8 9"),
    ):
        assert replace_tokens(line, (1, 2, 3), (b"7", b"8", b"9")) == written
