from dnf_pyg.evaluate.benchmark.rows import Failure
from dnf_pyg.evaluate.benchmark.tables import bold_lowest, csv_table, document, markdown_table, number


def test_cells():
    assert [number(1.23456), number(1.5, digits=1, bold=True), number(None)] == ["1.235", "**1.5**", ""]
    assert bold_lowest([1.0, None, 1.0, 3.0]) == ["**1.000**", "", "**1.000**", "3.000"]
    assert bold_lowest([None]) == [""]


def test_bars_in_names_do_not_split_cells():
    assert markdown_table(["mesh", "a|b"], [["x|y", "1"]]).splitlines() == [
        r"| mesh | a\|b |", "| --- | ---: |", r"| x\|y | 1 |",
    ]  # fmt: skip


def test_csv_rounds_and_quotes():
    assert csv_table(["mesh", "theta"], [["a,b", 1.23456], ["c", None]]) == 'mesh,theta\n"a,b",1.2346\nc,\n'


def test_document():
    text = document("Title", ["First.", "Second."], {"Part": "Text."}, [Failure("a_n1", "x", "bad")])
    assert text == "# Title\n\nFirst.\n\nSecond.\n\n## Part\n\nText.\n\n## Failures\n\n- a_n1, x: bad\n"
    assert document("Title", [], {}) == "# Title\n"
