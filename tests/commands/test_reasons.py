"""Wrong arguments of training are told in one sentence, before anything is read or written."""

import pytest

from dnf_pyg.cli import main

CONFIG = """\
trainer: {accelerator: cpu, logger: false}
model: {net: {class_path: dnf_pyg.nn.DNFNet, init_args: {k: [4, 6, 8], channels: [8, 8, 8]}}}
data: {class_path: dnf_pyg.datamodules.CNRDataModule, init_args: {root: absent, patches: {k: 8}}}
"""


@pytest.mark.parametrize(
    ("word", "text"),
    [
        ("--data.k=50", "Expected an argument of CNRDataModule: root, subset, patches, loader, val_share, broken, "
                        "cache (got 'k'). See `dnf-pyg fit --help`."),
        ("--data.patches.k=abc", "Expected 'data.patches.k' to be int (got abc). See `dnf-pyg fit --help`."),
        ("--data.subset=Nope", "Expected 'data.subset' to be Synthetic, Kinect_v1, Kinect_v2, Kinect_Fusion (got "
                               "Nope). See `dnf-pyg fit --help`."),
        ("--data.patches.num_patches=0", "Expected 'num_patches' of at least 1 (got 0). Raise it."),
        ("--data.loader.batch_size=0", "Expected 'batch_size' of at least 1 (got 0). Raise it."),
        ("--data.root=\udcff", "Expected 'data' in UTF-8 (got other bytes). Give the file or folder a name in UTF-8. "
                               "See `dnf-pyg fit --help`."),
        ("--model.net.k=[3]", "Expected 'k' and 'channels' of equal length (got [3] and [8, 8, 8]). Give one number of "
                              "each for every level."),
        ("--trainer.max_steps=-5", "Expected arguments that Lightning takes (got: `max_steps` must be a non-negative "
                                   "integer or -1 (infinite steps). You passed in -5.) Change the config."),
    ],
)  # fmt: skip
def test_wrong_arguments_of_training(tmp_path, capsys, word, text):
    (tmp_path / "small.yaml").write_text(CONFIG)
    assert main(["fit", "-c", str(tmp_path / "small.yaml"), word]) == 2
    assert capsys.readouterr().err.splitlines()[-1] == f"dnf-pyg: {text}"


def test_wrong_type_of_several_kinds(tmp_path, capsys):
    (tmp_path / "small.yaml").write_text(CONFIG)
    assert main(["fit", "-c", str(tmp_path / "small.yaml"), "--trainer.precision=17"]) == 2
    told = capsys.readouterr().err
    assert "Expected 'trainer.precision' to be 64, 32, 16, transformer-engine" in told
    assert told.endswith("null (got 17). See `dnf-pyg fit --help`.\n")


def test_machine_of_predict(tmp_path, capsys):
    (tmp_path / "in").mkdir()
    (tmp_path / "in" / "a.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    words = ["predict", str(tmp_path / "in"), "-o", str(tmp_path), "--weights", "small"]
    assert main([*words, "--trainer.accelerator=cpu", "--trainer.devices=0"]) == 2
    assert "Expected a trainer of this machine" in capsys.readouterr().err
