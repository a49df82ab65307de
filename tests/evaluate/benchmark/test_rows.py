import pytest

from dnf_pyg.errors import DataError
from dnf_pyg.evaluate.benchmark import Row, RowLog, read_published, read_results


def test_log_finds_the_newest_row_of_the_same_parameters_and_data(tmp_path):
    log = RowLog(tmp_path / "log")
    old, new = Row("box", "n1", "net", 1.0, "p", "d"), Row("box", "n1", "net", 2.0, "p", "d")
    log.add(old)
    log.add(new)
    assert RowLog(tmp_path / "log").rows == [old, new]
    assert log.find("box", "n1", "net", "p", "d") == new
    assert log.find("box", "n1", "net", "other", "d") is None
    assert log.find("box", "n1", "net", "p", "other") is None


def test_log_of_something_else(tmp_path):
    (tmp_path / "log").write_text('{"no": "row"}\n')
    with pytest.raises(DataError, match=r"Delete it to start afresh\."):
        RowLog(tmp_path / "log")


def test_published_settings_are_columns_and_the_noisy_mesh_is_none(tmp_path):
    path = tmp_path / "peers.csv"
    path.write_text(
        "mesh,noise,method,setting,parameters,theta_deg\n"
        "box,n1,SD,default,default,1.5\nbox,n1,SD,oracle,nu=0.3,1.25\nbox,n1,noisy,default,,10.5\n"
    )
    assert [(row.method, row.theta_deg) for row in read_published(path)] == [("SD default", 1.5), ("SD oracle", 1.25)]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("mesh,noise,method\nbox,n1,SD\n", "none called theta_deg"),
        ("", "columns"),
        ("mesh,noise,method,theta_deg\nbox,n1,SD,low\n", r"line 2 \(got 'low'\)"),
    ],
)
def test_published_file_of_another_form(tmp_path, text, message):
    (tmp_path / "peers.csv").write_text(text)
    with pytest.raises(DataError, match=message):
        read_published(tmp_path / "peers.csv")


def test_published_file_that_is_not_there(tmp_path):
    with pytest.raises(DataError, match=r"Check the path\."):
        read_published(tmp_path / "absent.csv")


@pytest.mark.parametrize("text", ["no json", "{}", '{"data": "set", "rows": [{"no": "row"}]}'])
def test_results_of_another_form(tmp_path, text):
    (tmp_path / "results.json").write_text(text)
    with pytest.raises(DataError, match=r"Expected results.json .*\. Give the file that it wrote\."):
        read_results(tmp_path / "results.json")
