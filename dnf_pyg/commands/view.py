"""Show meshes in 3D in the browser."""

import tempfile
import webbrowser
from pathlib import Path

from dnf_pyg.commands.outputs import check_output
from dnf_pyg.commands.terminal import tell
from dnf_pyg.commands.view_options import ViewOptions
from dnf_pyg.io import read_mesh
from dnf_pyg.view import Camera, write_view

__all__ = ["run"]


def run(options: ViewOptions) -> None:
    """Write the page, and open it unless it was given a name.

    Raises:
        MeshFileError: If a mesh cannot be read.
        OutputError: If the page exists already, or cannot be written.
    """
    if options.output is not None:
        check_output(options.output, overwrite=options.overwrite, suffixes=(".html", ".htm"))
    meshes = {}
    for path in options.input:
        mesh = read_mesh(path)
        meshes[str(path) if path.name in meshes else path.name] = mesh.pos, mesh.face
    page = options.output or Path(tempfile.mkdtemp(prefix="dnf_pyg_")) / "view.html"
    write_view(page, meshes, title=", ".join(meshes), camera=Camera.choose(*meshes.values(), view=options.view))
    tell(f"page in 3D: {page}")
    if options.output is None:
        webbrowser.open(page.as_uri())
