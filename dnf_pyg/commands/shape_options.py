"""Options of the commands that make meshes to try things on, as dataclasses (see :mod:`dnf_pyg.commands.options`)."""

from dataclasses import KW_ONLY, dataclass, field
from pathlib import Path

from dnf_pyg.options import check_range

__all__ = ["AddNoiseOptions", "DemoOptions", "MakeShapeOptions"]


@dataclass(frozen=True)
class DemoOptions:
    """Make a noisy part and a noisy scan, denoise both, and show the results.

    Examples:
        dnf-pyg demo
        dnf-pyg demo -o try --faces 5000

    Args:
        output: Folder for meshes, pictures and pages.
        faces: Number of faces of each mesh.
    """

    _: KW_ONLY
    output: Path = Path("dnf_pyg_demo")
    faces: int = 12000

    def __post_init__(self) -> None:
        check_range("faces", self.faces, int, 4000, 10**6)


@dataclass(frozen=True)
class AddNoiseOptions:
    """Add noise to a clean mesh.

    Examples:
        dnf-pyg add-noise clean.obj -o noisy.obj --level 0.3

    Args:
        clean: Mesh to add noise to (obj, ply, stl, off, glb, gltf).
        output: Mesh to write.
        overwrite: Replace the output if it exists.
        kind: Noise model.
        level: Standard deviation, in mean edge lengths.
        seed: The same seed gives the same noise.
    """

    clean: Path
    _: KW_ONLY
    output: Path
    overwrite: bool = False
    kind: str = field(default="gaussian", metadata={"choices": "dnf_pyg.mesh.noise:NOISE_KINDS"})
    level: float = 0.2
    seed: int = 0

    def __post_init__(self) -> None:
        check_range("level", self.level, float, 0, float("inf"))
        check_range("seed", self.seed, int, 0, 2**63 - 1)


@dataclass(frozen=True)
class MakeShapeOptions:
    """Make a clean mesh in code, to try things on.

    Examples:
        dnf-pyg make-shape bracket -o clean.obj --faces 20000 --seed 2

    Args:
        kind: Kind of shape; its details are drawn at random.
        output: Mesh to write.
        overwrite: Replace the output if it exists.
        faces: Approximate number of faces.
        seed: The same seed gives the same mesh.
    """

    kind: str = field(metadata={"choices": "dnf_pyg.synthetic.shapes:SHAPES"})
    _: KW_ONLY
    output: Path
    overwrite: bool = False
    faces: int = 8000
    seed: int = 0

    def __post_init__(self) -> None:
        check_range("faces", self.faces, int, 1, float("inf"))
        check_range("seed", self.seed, int, 0, 2**63 - 1)
