import re
from html import unescape

import pytest

from dnf_pyg.errors import DataError
from dnf_pyg.view import PageView


def test_page_is_in_the_frame_whole(tmp_path):
    page = "<!doctype html><p title=\"a & b\">'x'</p>"
    (tmp_path / "page.html").write_text(page)
    frame = PageView(tmp_path / "page.html", height=300)._repr_html_()
    assert unescape(re.search(r'srcdoc="([^"]*)"', frame)[1]) == page
    assert "height: 300px" in frame


def test_missing_page_is_named(tmp_path):
    with pytest.raises(DataError, match=r"got '.*absent.html': No such file or directory\)\. Write it"):
        PageView(tmp_path / "absent.html")
