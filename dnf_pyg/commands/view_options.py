"""Options of the commands that show meshes, as dataclasses (see :mod:`dnf_pyg.commands.options`)."""

from dataclasses import KW_ONLY, dataclass
from pathlib import Path

from dnf_pyg.options import DEFAULT_WEIGHTS, Direction, check_range

__all__ = ["ServeOptions", "ViewOptions"]


@dataclass(frozen=True)
class ViewOptions:
    """Show meshes in 3D, side by side, in a page that opens in the browser.

    Examples:
        dnf-pyg view scan.ply
        dnf-pyg view noisy.obj denoised.obj -o page.html

    Args:
        input: Meshes (obj, ply, stl, off, glb, gltf).
        output: HTML page to write, which then is not opened. A temporary file if not given.
        overwrite: Replace the page if it exists.
        view: Direction that the meshes are seen from at first; auto chooses one that suits them.
    """

    input: tuple[Path, ...]
    _: KW_ONLY
    output: Path | None = None
    overwrite: bool = False
    view: Direction = "auto"


@dataclass(frozen=True)
class ServeOptions:
    """Denoise meshes in the browser: upload, settings, view in 3D, download.

    Examples:
        dnf-pyg serve
        dnf-pyg serve --port 8000 --max_megabytes 500

    The page is for this computer alone unless another host is given. Then everybody who reaches the port can use it:
    there is no password. Uploads and results are deleted after an hour, and when the server ends.

    Args:
        host: Address that the server listens on; 0.0.0.0 is all of this computer.
        port: Port that it listens on; the first free one from 7860 if not given.
        max_megabytes: Size up to which files are taken.
        weights: Checkpoint of `dnf-pyg fit`, folder, or name of packaged weights (see `dnf-pyg weights`).
        device: Device on which the network runs: auto, cpu, cuda, cuda:1, mps.
    """

    _: KW_ONLY
    host: str = "127.0.0.1"
    port: int | None = None
    max_megabytes: int = 100
    weights: str = DEFAULT_WEIGHTS
    device: str = "auto"

    def __post_init__(self) -> None:
        if self.port is not None:
            check_range("port", self.port, int, 1, 65535)
        check_range("max_megabytes", self.max_megabytes, int, 1, float("inf"))
