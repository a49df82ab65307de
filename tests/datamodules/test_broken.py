"""A mesh that cannot be read, among others: named, and the run stops before training or goes on without it."""

import pytest
import trimesh

from dnf_pyg.datamodules import (
    CleanMeshesDataModule,
    CNRDataModule,
    DepthCameraDataModule,
    LoaderOptions,
    PairsDataModule,
)
from dnf_pyg.errors import DataError
from dnf_pyg.patches import PatchOptions

SMALL = {"patches": PatchOptions(num_patches=2, patch_size=40, k=8), "loader": LoaderOptions(batch_size=2)}


@pytest.fixture(params=["pairs", "clean", "camera", "cnr"])
def case(request, pair_folders, tmp_path):
    """Makes a data module over three meshes, two of them broken, and the names of the broken ones."""
    clean, noisy = pair_folders
    cache = str(tmp_path / "cache")
    if request.param == "pairs":
        (noisy / "box0_n1.obj").write_text("not a mesh")
        trimesh.creation.icosphere(1).export(noisy / "box1_n2.obj")
        build = lambda **options: PairsDataModule(str(noisy), str(clean), cache=cache, **options)  # noqa: E731
        return build, ["box0_n1.obj", "box1_n2.obj"], {"box0", "box1", "box2"}
    if request.param == "cnr":
        folder = tmp_path / "cnr" / "Synthetic" / "train"
        folder.mkdir(parents=True)
        clean.rename(folder / "original")
        noisy.rename(folder / "noisy")
        for name in ("box0_n1.obj", "box0_n2.obj"):
            (folder / "noisy" / name).write_text("not a mesh")
        build = lambda **options: CNRDataModule(str(tmp_path / "cnr"), cache=cache, **options)  # noqa: E731
        return build, ["box0_n1.obj", "box0_n2.obj"], {"box1", "box2"}
    (clean / "box0.obj").write_text("not a mesh")
    if request.param == "clean":
        build = lambda **options: CleanMeshesDataModule(str(clean), cache=cache, **options)  # noqa: E731
        return build, ["box0.obj"], {"box1", "box2"}
    build = lambda **options: DepthCameraDataModule(str(clean), cache, num_views=1, **options)  # noqa: E731
    return build, ["box0.obj"], {"box1-0", "box2-0"}


def test_stops_before_anything_is_prepared(case, tmp_path):
    build, broken, _ = case
    with pytest.raises(DataError, match="(?s)" + ".*".join(broken) + ".*broken: skip"):
        build(**SMALL).prepare_data()
    assert not list((tmp_path / "cache").rglob("*.npy"))


def test_goes_on_without_it(case):
    build, broken, left = case
    data = build(broken="skip", val_share=0.34, **SMALL)
    with pytest.warns(match="(?s)left out.*" + ".*".join(broken)):
        data.prepare_data()
    served = {path.stem for split in ("train", "val") for _, path in data.dataset(split).pairs}
    assert served == left
    assert next(iter(data.train_dataloader())).x.shape == (80, 3) or "-0" in min(left)


def test_nothing_left_is_an_error(clean_folder, tmp_path):
    for path in clean_folder.iterdir():
        path.write_text("not a mesh")
    with pytest.raises(DataError, match="3 others of 3"):
        CleanMeshesDataModule(str(clean_folder), cache=str(tmp_path), broken="skip", **SMALL).prepare_data()
