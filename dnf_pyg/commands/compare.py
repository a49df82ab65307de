"""Measure a mesh against its clean reference: theta in degrees, E_v, share of faces within 5 and 10 degrees."""

import json
import sys
from dataclasses import replace
from pathlib import Path

import torch
from torch import Tensor

from dnf_pyg.commands.options import CompareOptions
from dnf_pyg.commands.terminal import tell
from dnf_pyg.errors import MeshError
from dnf_pyg.evaluate.measures import normal_angles, vertex_errors
from dnf_pyg.io import MeshFile, read_mesh
from dnf_pyg.mesh.correspondence import corresponding_faces
from dnf_pyg.mesh.geometry import face_normals
from dnf_pyg.mesh.validate import validate_mesh

__all__ = ["measure", "read_reference", "run"]


def run(options: CompareOptions) -> None:
    """Print the measures."""
    mesh = read_mesh(options.mesh)
    validate_mesh(mesh.pos, mesh.face)
    reference = read_reference(options.reference, mesh)
    values = measure(mesh.pos, mesh.face, reference)
    if options.json:
        tell(json.dumps(values))
    else:
        tell(
            f"theta              {values['theta']:8.3f} degrees",
            f"E_v                {values['vertex_error']:8.4f} mean edge lengths",
            f"within 5 degrees   {values['within_5_degrees']:8.1%} of the faces",
            f"within 10 degrees  {values['within_10_degrees']:8.1%} of the faces",
        )


def read_reference(path: Path, mesh: MeshFile) -> MeshFile:
    """Read a clean mesh whose faces correspond to those of another; its faces come in the order of that one's.

    A line on stderr tells where that is not their order in the file.

    Raises:
        MeshError: If its number of faces differs, it has coordinates that are not finite, or only faces without area.
    """
    reference = read_mesh(path)
    validate_mesh(reference.pos, reference.face)
    if reference.face.shape != mesh.face.shape:
        raise MeshError(
            f"Expected a reference with the same faces (got {reference.face.size(1)} faces in '{path}', "
            f"{mesh.face.size(1)} in '{mesh.path}'). Give the clean version of the same mesh."
        )
    if not face_normals(reference.pos, reference.face).any():
        raise MeshError(f"Expected a reference with an area (got '{path}', whose faces have none). Export it again.")
    order = corresponding_faces(mesh.pos, mesh.face, reference.pos, reference.face)
    if not torch.equal(order, torch.arange(len(order))):
        tell(
            f"warning: the faces of '{path}' are in another order than those of '{mesh.path}': each of them is "
            "compared with the one at its place.",
            file=sys.stderr,
        )
    face = reference.face[:, order]
    of_same_vertices = torch.equal(face.sort(dim=0).values, mesh.face.sort(dim=0).values)
    return replace(reference, face=mesh.face if of_same_vertices else face)


def measure(pos: Tensor, face: Tensor, reference: MeshFile) -> dict[str, float]:
    """Theta, E_v and shares of faces of a mesh, pos (V, 3) and face (3, F), against a clean mesh of as many faces."""
    angle = normal_angles(face_normals(pos, face), face_normals(reference.pos, reference.face))
    return {
        "theta": float(angle.double().mean()),
        "vertex_error": float(vertex_errors(pos, reference.pos, reference.face).mean()),
        "within_5_degrees": float((angle <= 5).double().mean()),
        "within_10_degrees": float((angle <= 10).double().mean()),
    }
