import os

import numpy as np
import pytest

from dnf_pyg.datasets.cache import load_entry, name_entry, write_entry

ARRAYS = {"face_id": np.arange(6).reshape(2, 3), "size": np.array([3, 3])}


def test_name_follows_content_and_parameters(tmp_path):
    (tmp_path / "one.obj").write_bytes(b"v 0 0 0\n")
    (tmp_path / "other").mkdir()
    (tmp_path / "other" / "one.obj").write_bytes(b"v 0 0 0\n")
    name = name_entry([tmp_path / "one.obj"], {"k": 3})
    assert name.startswith("one-")
    assert name_entry([tmp_path / "other" / "one.obj"], {"k": 3}) == name
    assert name_entry([tmp_path / "one.obj"], {"k": 4}) != name
    (tmp_path / "one.obj").write_bytes(b"v 0 0 1\n")
    assert name_entry([tmp_path / "one.obj"], {"k": 3}) != name


def test_what_is_written_is_mapped_read_only(tmp_path):
    write_entry(tmp_path / "processed" / "one", ARRAYS)
    entry = load_entry(tmp_path / "processed" / "one")
    assert entry.keys() == ARRAYS.keys()
    np.testing.assert_array_equal(entry["face_id"], ARRAYS["face_id"])
    with pytest.raises(ValueError, match="read-only"):
        entry["face_id"][0, 0] = 7


def test_the_first_of_two_writers_is_kept(tmp_path):
    write_entry(tmp_path / "one", ARRAYS)
    write_entry(tmp_path / "one", {name: array + 1 for name, array in ARRAYS.items()})
    np.testing.assert_array_equal(load_entry(tmp_path / "one")["size"], ARRAYS["size"])
    assert os.listdir(tmp_path) == ["one"]


def test_a_writer_that_fails_leaves_nothing(tmp_path, monkeypatch):
    def full(path, array, save=np.save):
        if path.stem == "size":
            raise OSError(28, os.strerror(28))
        save(path, array)

    monkeypatch.setattr(np, "save", full)
    with pytest.raises(OSError, match="No space left"):
        write_entry(tmp_path / "one", ARRAYS)
    assert os.listdir(tmp_path) == []
