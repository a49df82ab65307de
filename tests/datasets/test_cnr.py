import pytest
import torch
from torch_geometric.transforms import Compose

from dnf_pyg.datasets import CNR
from dnf_pyg.datasets.cnr import PAPER_PATCHES
from dnf_pyg.errors import DataError
from dnf_pyg.io import read_mesh
from dnf_pyg.mesh import face_normals
from dnf_pyg.patches import PatchOptions
from dnf_pyg.transforms import JitterNormal

SMALL = PatchOptions(num_patches=3, patch_size=40, k=8)


@pytest.mark.parametrize(("subset", "split", "num_meshes"), [("Synthetic", "train", 4), ("Kinect_v2", "test", 1)])
def test_serves_patches_of_the_files(cnr_folder, tmp_path, subset, split, num_meshes):
    dataset = CNR(cnr_folder, subset, split, patches=SMALL, cache=tmp_path)
    assert len(dataset.pairs) == num_meshes
    assert len(dataset) == 3 * num_meshes
    for row in (0, len(dataset) - 1):
        data = dataset[row]
        for path, name in zip(dataset.pairs[row // 3], ("x", "y"), strict=True):
            mesh = read_mesh(path)
            torch.testing.assert_close(data[name], face_normals(mesh.pos, mesh.face)[data.face_id].float())


def test_transform_is_applied_when_served(cnr_folder, tmp_path):
    plain = CNR(cnr_folder, patches=SMALL, cache=tmp_path)
    jittered = CNR(cnr_folder, transform=Compose([JitterNormal(0.1, 0.2)]), patches=SMALL, cache=tmp_path)
    assert not torch.equal(plain[0].x, jittered[0].x)
    assert torch.equal(plain[0].y, jittered[0].y)
    assert plain.processed_file_names == jittered.processed_file_names


def test_patches_of_the_paper():
    numbers = {
        subset: (patches.num_patches, patches.patch_size, patches.k) for subset, patches in PAPER_PATCHES.items()
    }
    kinect = {f"Kinect_{kind}": (200, 800, 150) for kind in ("v1", "v2", "Fusion")}
    assert numbers == {"Synthetic": (100, 800, 50), **kinect}


def test_missing_folder_names_the_source_and_the_layout(tmp_path):
    text = r"Synthetic.train.original'.*Cascaded Normal Regression.*project page.*ROOT/SUBSET/\{train,test\}/"
    with pytest.raises(DataError, match=text):
        CNR(tmp_path)
