"""Class paths in configs and on the command line: only those of known packages are imported."""

import pytest
import yaml

from dnf_pyg.cli import main
from dnf_pyg.commands.class_policy import restrict_classes
from dnf_pyg.errors import DataError


@pytest.fixture
def module(tmp_path, monkeypatch, request):
    """A module that leaves a mark when it is imported."""
    name = f"stranger{abs(hash(request.node.name))}"  # what one test allows stays allowed in this process
    (tmp_path / f"{name}.py").write_text(
        f"open({str(tmp_path / 'imported')!r}, 'w').close()\n"
        "from lightning.pytorch import Callback\nclass Mine(Callback): pass\n"
    )
    monkeypatch.syspath_prepend(tmp_path)
    return name


def test_words_for_modules_are_taken_out():
    words = ["fit", "--allow_class", "mine", "-c", "x.yaml", "--allow_class=yours.deeper", "--allow_classes", "3"]
    assert restrict_classes(words) == ["fit", "-c", "x.yaml", "--allow_classes", "3"]


@pytest.mark.parametrize("words", [["--allow_class"], ["--allow_class=not a module"], ["--allow_class=jsonargparse"]])
def test_says_what_is_wrong(words):
    with pytest.raises(DataError, match="name of a module"):
        restrict_classes(words)


@pytest.mark.parametrize("spelling", ["word", "config"])
def test_class_of_another_module_is_not_imported(tmp_path, capsys, monkeypatch, module, spelling):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "in").mkdir()
    (tmp_path / "in" / "a.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    (tmp_path / "out").mkdir()
    (tmp_path / "c.yaml").write_text(yaml.safe_dump({"trainer": {"plugins": {"class_path": f"{module}.Mine"}}}))
    more = ["-c", "c.yaml"] if spelling == "config" else [f"--trainer.plugins={{class_path: {module}.Mine}}"]
    assert main(["predict", "in", "-o", "out", *more]) == 2
    told = capsys.readouterr().err
    assert f"(got '{module}.Mine'). Add `--allow_class {module}` if you trust it." in told
    assert told.count("\n") == 1
    assert not (tmp_path / "imported").exists()


def test_class_that_another_package_only_passes_on_is_refused(capsys):
    assert main(["fit", "-c", "synthetic", "--model.optimizer=torch.hub.os.system"]) == 2
    assert "(got 'posix.system')" in capsys.readouterr().err
