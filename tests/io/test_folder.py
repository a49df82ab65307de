import os

import pytest

from dnf_pyg.io.folder import CompanionError, find_beside, is_beside


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "mesh" / "below").mkdir(parents=True)
    for name in ("secret.png", "mesh/Grün.png", "mesh/below/wood.png"):
        (tmp_path / name).write_bytes(b"")
    return tmp_path / "mesh"


@pytest.mark.parametrize(
    ("name", "found"),
    [
        ("below/wood.png", "below/wood.png"),
        ("below\\wood.png", "below/wood.png"),
        ("below/../below/./wood.png", "below/wood.png"),
        ("BELOW/Wood.PNG", "below/wood.png"),
        ("gru\u0308n.png", "Grün.png"),  # the accent as a character of its own
        (b"Gr\xfcn.png".decode(errors="surrogateescape"), "Grün.png"),  # Latin-1
    ],
)
def test_finds_files_below_the_folder(folder, name, found):
    assert find_beside(folder, name) == folder / found


@pytest.mark.parametrize(
    ("name", "reason"),
    [
        ("../secret.png", "outside the folder"),
        ("below/../../secret.png", "outside the folder"),
        ("..\\secret.png", "outside the folder"),
        ("{}/secret.png", "absolute path"),
        ("C:\\secret.png", "absolute path"),
        ("file:///secret.png", "absolute path"),
        ("http://example.org/a.png", "absolute path"),
        ("link.png", "link that leaves"),
        ("away/secret.png", "link that leaves"),
        ("pipe", "not a regular file"),
        ("below", "not a regular file"),
        ("", "not a regular file"),
        ("absent.png", "does not exist"),
        ("a\0b", "does not exist"),
        ("a" * 5000, "does not exist"),
        ("\ud800.png", "does not exist"),
        ("circle", "does not exist"),
        ("%2e%2e/secret.png", "does not exist"),  # what is decoded once is not decoded again
    ],
)
def test_refuses_what_leads_elsewhere(folder, name, reason):
    (folder / "link.png").symlink_to("../secret.png")
    (folder / "away").symlink_to("..")
    (folder / "circle").symlink_to("circle")
    os.mkfifo(folder / "pipe")
    with pytest.raises(CompanionError, match=reason):
        find_beside(folder, name.format(folder.parent))
    assert not is_beside(folder, name)


def test_link_inside_the_folder_and_a_folder_that_is_a_link(folder, tmp_path):
    (folder / "alias.png").symlink_to("below/wood.png")
    (tmp_path / "other").symlink_to("mesh")
    assert find_beside(tmp_path / "other", "alias.png") == tmp_path / "other" / "alias.png"
