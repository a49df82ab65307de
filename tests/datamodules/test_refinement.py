import pytest
import torch

from dnf_pyg import FilterOptions, UpdateOptions, denoise
from dnf_pyg.datamodules import LoaderOptions, PairsDataModule
from dnf_pyg.datamodules.refinement import Refinement
from dnf_pyg.datasets import PatchDataset
from dnf_pyg.errors import DataError
from dnf_pyg.io import read_mesh
from dnf_pyg.mesh import face_normals
from dnf_pyg.nn import SurfaceDNFNet
from dnf_pyg.patches import PatchOptions


@pytest.fixture
def weights(tmp_path):
    torch.manual_seed(0)
    net = SurfaceDNFNet(k=(3, 5), residual_k=4, channels=(8, 8), embedding_channels=8)
    net.save_pretrained(tmp_path / "first")
    return tmp_path / "first"


@pytest.mark.parametrize("fresh", [False, True])
def test_patches_show_what_the_earlier_networks_made(pair_folders, weights, fresh):
    clean, noisy = pair_folders
    data = PairsDataModule(
        str(noisy), str(clean), refinement=Refinement(str(weights), precision="fp32"), fresh=fresh,
        patches=PatchOptions(4, 40, k=8), loader=LoaderOptions(batch_size=2, rotate=False, jitter=0), val_share=0,
    )  # fmt: skip
    dataset = data.dataset("train")
    given = read_mesh(dataset.pairs[0][0])
    update = UpdateOptions(max_excess=float("inf"))
    result = denoise(given, weights, filtering=FilterOptions(precision="fp32"), update=update)
    found = dataset[0]
    torch.testing.assert_close(found.x.double(), face_normals(result.pos, given.face)[found.face_id], rtol=0, atol=1e-4)
    expected = torch.stack([result.normal.double(), face_normals(given.pos, given.face)], dim=1)[found.face_id]
    torch.testing.assert_close(found.earlier.double(), expected, rtol=0, atol=1e-5)
    assert next(iter(data.train_dataloader())).earlier.shape == (80, 2, 3)


def test_name_follows_weights_and_options(weights, tmp_path):
    one, other = (repr(Refinement(str(weights), UpdateOptions(num_iterations=n))) for n in (10, 20))
    assert one != other
    SurfaceDNFNet(k=(3, 5), residual_k=4, channels=(8, 8), embedding_channels=8).save_pretrained(tmp_path / "second")
    assert repr(Refinement(str(tmp_path / "second"), UpdateOptions(num_iterations=10))) != one


def test_needs_noisy_meshes(pair_folders, weights, tmp_path):
    clean, _ = pair_folders
    with pytest.raises(DataError, match="a noisy file of each mesh that is refined"):
        PatchDataset(
            tmp_path, [(None, next(clean.iterdir()))], noise=lambda *given: given[0], refine=Refinement(str(weights))
        )
