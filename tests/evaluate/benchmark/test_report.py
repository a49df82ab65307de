import csv
import json
from dataclasses import replace

import pytest

from dnf_pyg.errors import OutputError
from dnf_pyg.evaluate.benchmark.report import markdown, summary_table, write_results
from dnf_pyg.evaluate.benchmark.rows import Failure, Row, read_published, read_results

ROWS = [
    Row("a", "n1", "net", 1.0, "net()", "", 8, 10.0, 1.5, 0.25, 2.0),
    Row("a", "n2", "net", 2.0, "net()", "", 8, 20.0, 2.5, 0.75, 4.0),
    Row("b", "n1", "net", 6.0, "net()", "", 9, 12.0, 6.5, 0.5, 3.0),
    Row("a", "n1", "peer", 0.5, "from peers.csv"),
    Row("a", "n2", "peer", 1.5, "from peers.csv"),
]


def lines_of(section, text):
    return text.split(f"## {section}\n\n")[1].split("\n\n")[0].splitlines()


def test_summary():
    lines = lines_of("Summary", markdown("Test", ROWS, num_threads=3))
    assert lines[2] == "| noisy | 11.000 | 20.000 | 14.000 |  |  |  |  |  |"
    # the peer lacks mesh b: its mean is over two, it can score but not be the best of all
    assert lines[3] == "| net | 3.500 | 2.000 | **3.000** | 3.500 | 0.5000 | 3.00 | 0.500 | 1 |"
    assert lines[4] == "| peer | 0.500 | 1.500 | 1.000 (2) |  |  |  | 1.000 | 1 |"
    assert "on 3 thread(s)" in markdown("Test", ROWS, num_threads=3)


def test_theta_by_mesh_and_by_noisy_mesh():
    text = markdown("Test", ROWS)
    assert lines_of("θ, mean of the noise levels", text)[2:] == [
        "| a | 15.000 | 1.500 | **1.000** |",
        "| b | 12.000 | **6.000** |  |",
    ]
    assert lines_of("θ", text)[3] == "| a | n2 | 20.000 | 2.000 | **1.500** |"
    assert lines_of("θ", text)[4] == "| b | n1 | 12.000 | **6.000** |  |"


def test_methods():
    text = markdown("Test", ROWS)
    assert lines_of("Methods", text) == ["- net: net()", "- peer: from peers.csv"]


def test_failures_come_last():
    text = markdown("Test", ROWS, [Failure("b_n1", "peer", "no such file")])
    assert text.endswith("## Failures\n\n- b_n1, peer: no such file\n")
    assert "Failures" not in markdown("Test", ROWS)


def test_nothing_but_failures():
    assert "- b_n1, peer: bad" in markdown("Test", [], [Failure("b_n1", "peer", "bad")])


def test_files_are_read_back(tmp_path):
    rows = [replace(ROWS[0], theta_deg=1.23456789), *ROWS[1:]]
    failures = [Failure("b_n1", "peer", "no such file")]
    write_results(tmp_path, "set/test", rows, failures, seed=3)
    assert summary_table(rows) in (tmp_path / "results.md").read_text()
    with (tmp_path / "results.csv").open() as file:
        lines = list(csv.DictReader(file))
    assert lines[0]["theta_deg"] == "1.2346"
    assert lines[3]["seconds"] == ""
    published = read_published(tmp_path / "results.csv")
    assert published[0] == Row("a", "n1", "net", 1.2346, "from results.csv")
    assert len(published) == 5
    assert read_results(tmp_path / "results.json") == ([replace(rows[0], theta_deg=1.2346), *ROWS[1:]], "set/test")
    content = json.loads((tmp_path / "results.json").read_text())
    assert content["failures"] == [{"noisy": "b_n1", "method": "peer", "reason": "no such file"}]
    assert list(content["summary"]) == ["net"]
    assert content["summary"]["net"]["vertex_error"] == 0.5
    assert (tmp_path / "scores.png").is_file()


def test_folder_that_is_missing(tmp_path):
    with pytest.raises(OutputError, match="absent"):
        write_results(tmp_path / "absent", "test", ROWS, [], 0)
