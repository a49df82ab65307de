"""Add noise to a clean mesh; its level is a multiple of the mean edge length."""

import torch

from dnf_pyg.commands.outputs import check_output
from dnf_pyg.commands.shape_options import AddNoiseOptions
from dnf_pyg.io import read_mesh, write_mesh
from dnf_pyg.mesh.noise import NOISE_KINDS

__all__ = ["run"]


def run(options: AddNoiseOptions) -> None:
    """Read, move the vertices, write.

    Raises:
        MeshFileError: If the mesh cannot be read.
        OutputError: If the output exists already, or cannot be written.
    """
    check_output(options.output, overwrite=options.overwrite)
    mesh = read_mesh(options.clean)
    generator = torch.Generator().manual_seed(options.seed)
    pos = NOISE_KINDS[options.kind]()(mesh.pos, mesh.face, options.level, generator)
    write_mesh(mesh, pos, options.output)
