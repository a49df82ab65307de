"""Find all meshes of a data set that cannot be trained on, before anything else is done with them."""

import json
from collections.abc import Sequence
from pathlib import Path

import torch
from tqdm import tqdm

from dnf_pyg.datasets.pairing import MeshPair
from dnf_pyg.errors import DNFError
from dnf_pyg.io import read_mesh
from dnf_pyg.io.atomic import write_bytes
from dnf_pyg.mesh.validate import validate_mesh

__all__ = ["find_faults"]


def find_faults(pairs: Sequence[MeshPair], root: str | Path) -> dict[MeshPair, str]:
    """Read every pair and find those that cannot be trained on.

    The results are kept in ``root/processed/checked.json``: files that have not changed since are not read again,
    neither by the next run nor by the other processes of this one.

    Args:
        pairs: Noisy file (or ``None``) and clean file of each mesh.
        root: Folder in which ``processed`` is written.

    Returns:
        What is wrong with each pair that cannot be read, has no faces, has coordinates that are not finite, or differs
        in the faces of its two files.

    Example:
        >>> import tempfile
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     list(find_faults([(None, "absent.obj")], folder).values())
        ["Expected a mesh file (got 'absent.obj', which does not exist). Check the path."]
    """
    path = Path(root) / "processed" / "checked.json"
    known = _read(path)
    marks = {pair: _mark(pair) for pair in pairs}
    unknown = [pair for pair, mark in marks.items() if mark not in known]
    for pair in tqdm(unknown, "Checking meshes", disable=len(unknown) < 10):
        known[marks[pair]] = _fault(pair)
    if unknown:
        path.parent.mkdir(parents=True, exist_ok=True)
        write_bytes(path, json.dumps(known, indent=0).encode())
    return {pair: known[mark] for pair, mark in marks.items() if known[mark]}


def _read(path: Path) -> dict[str, str]:
    try:
        known = json.loads(path.read_text())
    except (OSError, ValueError):  # missing or damaged: all meshes are read again
        return {}
    return known if isinstance(known, dict) else {}


def _mark(pair: MeshPair) -> str:
    """Make a key that changes with the files of the pair."""
    stats = [(path, path.stat()) for path in (Path(part) for part in pair if part) if path.is_file()]
    return json.dumps([[str(path), stat.st_size, stat.st_mtime_ns] for path, stat in stats] or [str(pair[1])])


def _fault(pair: MeshPair) -> str:
    """Describe what is wrong with a pair; empty if nothing is."""
    try:
        meshes = [read_mesh(path) for path in pair if path]
        for mesh in meshes:
            try:
                validate_mesh(mesh.pos, mesh.face)
            except DNFError as error:
                return f"'{mesh.path}': {error}"
    except DNFError as error:
        return str(error)
    one, two = meshes[0].face, meshes[-1].face
    if not torch.equal(one, two):
        return f"{one.size(1)} and {two.size(1)} faces, or the same in another order"
    return ""
