import pytest
import torch
import trimesh


@pytest.fixture
def clean_folder(tmp_path):
    """Three small clean meshes."""
    folder = tmp_path / "clean"
    folder.mkdir()
    for number in range(3):
        mesh = trimesh.creation.box(extents=(1, 2, 1 + number)).subdivide().subdivide()
        mesh.export(folder / f"box{number}.obj")
    return folder


@pytest.fixture
def pair_folders(clean_folder, tmp_path):
    """The clean meshes, and two noisy versions of each."""
    noisy = tmp_path / "noisy"
    noisy.mkdir()
    for path in clean_folder.iterdir():
        mesh = trimesh.load(path, process=False)
        for version in (1, 2):
            generator = torch.Generator().manual_seed(version)
            moved = mesh.vertices + 0.02 * torch.randn(mesh.vertices.shape, generator=generator).numpy()
            trimesh.Trimesh(moved, mesh.faces, process=False).export(noisy / f"{path.stem}_n{version}.obj")
    return clean_folder, noisy
