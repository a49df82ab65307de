"""Series of noisy meshes for the paper's tests of robustness, made from clean ones.

Source: Li et al. 2020, Sec. 4.4.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from zlib import crc32

import torch
import trimesh
from torch import Generator, Tensor

from dnf_pyg.errors import DataError
from dnf_pyg.io import read_mesh, write_mesh
from dnf_pyg.mesh.noise import NOISE_KINDS, GaussianNormalNoise, Noise

__all__ = ["SERIES", "Input", "Series", "split_faces"]


@dataclass(frozen=True)
class Input:
    """A noisy mesh of a series.

    Attributes:
        mesh: Name of the mesh that it comes from.
        setting: Setting of the series that it was made with.
        noisy: File of the noisy mesh.
        clean: File of the clean one with the same faces.
    """

    mesh: str
    setting: str
    noisy: Path
    clean: Path


@dataclass(frozen=True)
class Series:
    """One test of robustness.

    Attributes:
        title: Heading.
        axis: Name of the quantity on the axis of the plot and in the first column of the table.
        settings: Settings in order.
        explanation: Text above the table that describes how the meshes were made.
        change: Function that gives the clean positions and faces of a mesh at a setting.
        noise: Function that gives the noise and its level, multiples of the mean edge length, at a setting.
        value: Function that gives the value on the axis for a setting and the mean number of faces there.
    """

    title: str
    axis: str
    settings: tuple[str, ...]
    explanation: str
    change: Callable[[Tensor, Tensor, str, Generator], tuple[Tensor, Tensor]]
    noise: Callable[[str], tuple[Noise, float]]
    value: Callable[[str, float], str] = lambda setting, num_faces: setting

    def prepare(self, clean: Sequence[Path], settings: Sequence[str], folder: Path) -> list[Input]:
        """Write the meshes of the series that do not exist yet, with random numbers seeded by their names.

        Args:
            clean: Clean meshes.
            settings: Settings to use, some of :attr:`settings`.
            folder: Where the meshes go.

        Raises:
            DataError: If there is no such setting.
            MeshError: If a mesh cannot be read.
        """
        unknown = [setting for setting in settings if setting not in self.settings]
        if unknown:
            raise DataError(
                f"Expected 'settings' from {', '.join(self.settings)} (got '{unknown[0]}'). Choose some of these."
            )
        folder.mkdir(parents=True, exist_ok=True)
        return [self._input(path, setting, folder) for path in clean for setting in settings]

    def _input(self, path: Path, setting: str, folder: Path) -> Input:
        name = f"{path.stem}-{setting}"
        found = Input(path.stem, setting, folder / f"{name}_noisy.ply", folder / f"{name}.ply")
        made = [target for target in (found.clean, found.noisy) if target.is_file()]
        if len(made) < 2 or min(target.stat().st_mtime_ns for target in made) < path.stat().st_mtime_ns:
            mesh = read_mesh(path)
            generator = torch.Generator().manual_seed(crc32(name.encode()))
            pos, face = self.change(mesh.pos, mesh.face, setting, generator)
            noise, level = self.noise(setting)
            for target, moved in ((found.clean, pos), (found.noisy, noise(pos, face, level, generator))):
                write_mesh(trimesh.Trimesh(pos.numpy(), face.t().numpy(), process=False), moved, target)
        return found


def split_faces(pos: Tensor, face: Tensor, share: float, generator: Generator | None = None) -> tuple[Tensor, Tensor]:
    """Split random faces in three at a random point: the surface stays, slivers and uneven vertex degrees appear.

    Args:
        pos: Vertex positions, (V, 3).
        face: Faces, (3, F).
        share: Probability that a face is split.
        generator: Source of the choice and of the points.

    Example:
        >>> pos, face = split_faces(torch.eye(3), torch.tensor([[0], [1], [2]]), 1.0)
        >>> pos.shape, face.shape, bool((pos[3].sum() - 1).abs() < 1e-6)
        (torch.Size([4, 3]), torch.Size([3, 3]), True)
    """
    chosen = torch.rand(face.size(1), generator=generator) < share
    a, b, c = face[:, chosen]
    weight = torch.rand((a.numel(), 3), generator=generator, dtype=pos.dtype).log().neg() + 1e-3  # uniform in the face
    weight = weight / weight.sum(dim=1, keepdim=True)
    point = (weight[:, :, None] * pos[face[:, chosen].t()]).sum(dim=1)
    new = torch.arange(a.numel()) + pos.size(0)
    thirds = [torch.stack(corners) for corners in ((a, b, new), (b, c, new), (c, a, new))]
    return torch.cat([pos, point]), torch.cat([face[:, ~chosen], *thirds], dim=1)


def _decimated(pos: Tensor, face: Tensor, setting: str, generator: Generator) -> tuple[Tensor, Tensor]:
    if setting == "1":
        return pos, face
    mesh = trimesh.Trimesh(pos.numpy(), face.t().numpy(), process=False)
    coarse = mesh.simplify_quadric_decimation(face_count=max(4, face.size(1) // int(setting)))
    return torch.tensor(coarse.vertices, dtype=pos.dtype), torch.tensor(coarse.faces).t().contiguous().long()


def _same(pos: Tensor, face: Tensor, setting: str, generator: Generator) -> tuple[Tensor, Tensor]:
    return pos, face


SERIES = {
    "resolution": Series(
        "Robustness to resolution",
        "number of faces",
        ("1", "2", "4", "8", "16", "32", "64"),
        "Each clean mesh is simplified by quadric edge collapse, its number of faces divided by the setting, then gets "
        "Gaussian noise of 0.1 mean edge lengths along the vertex normals. Numbers of faces are means of the meshes. "
        "The paper tests Eros with 100,000 down to 1,562 faces.",
        _decimated,
        lambda setting: (GaussianNormalNoise(), 0.1),
        lambda setting, num_faces: f"{num_faces:,.0f}",
    ),
    "triangulation": Series(
        "Robustness to irregular triangulation",
        "share of the faces split",
        ("0", "0.25", "0.5", "1"),
        "A share of the faces is split in three at a random point, which leaves the surface as it is and makes slivers "
        "and uneven vertex degrees; Gaussian noise of 0.3 mean edge lengths, as in the paper. The paper shows two "
        "irregular meshes, without figures to compare with.",
        lambda pos, face, setting, generator: split_faces(pos, face, float(setting), generator),
        lambda setting: (GaussianNormalNoise(), 0.3),
    ),
    "noise-kinds": Series(
        "Robustness to the kind of noise",
        "noise",
        tuple(NOISE_KINDS),
        "Noise of level 0.2 of each kind (`dnf_pyg.mesh.noise` says what the level means); the paper names uniform and "
        "impulsive noise without their levels.",
        _same,
        lambda setting: (NOISE_KINDS[setting](), 0.2),
    ),
    "noise-levels": Series(
        "Robustness to the intensity of noise",
        "noise level (mean edge lengths)",
        ("0.1", "0.2", "0.3", "0.4", "0.5", "0.6", "0.7"),
        "Gaussian noise along the vertex normals, of the levels of the paper's figure.",
        _same,
        lambda setting: (GaussianNormalNoise(), float(setting)),
    ),
}
