"""Make a clean mesh in code, to try things on."""

import trimesh

from dnf_pyg.commands.outputs import check_output
from dnf_pyg.commands.shape_options import MakeShapeOptions
from dnf_pyg.commands.terminal import tell
from dnf_pyg.io import write_mesh
from dnf_pyg.progress import progress_bar
from dnf_pyg.synthetic.shapes import SHAPES
from dnf_pyg.synthetic.shapes.sized import sized_shape

__all__ = ["run"]


def run(options: MakeShapeOptions) -> None:
    """Make and write one shape.

    Raises:
        OutputError: If the output exists already, or cannot be written.
    """
    check_output(options.output, overwrite=options.overwrite)
    with progress_bar(f"making a {options.kind} of about {options.faces} faces", "attempt") as report:
        pos, face = sized_shape(SHAPES[options.kind], options.seed, options.faces, progress=report)
    write_mesh(trimesh.Trimesh(pos.numpy(), face.t().numpy(), process=False), pos, options.output)
    tell(f"{options.output}: {face.size(1)} faces")
