"""The numbers of a benchmark, a row per method and noisy mesh, and the files that hold them."""

import csv
import io
import json
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass, fields
from pathlib import Path
from typing import Any

from dnf_pyg.errors import DataError
from dnf_pyg.io.atomic import write_bytes

__all__ = ["Row", "RowLog", "read_published", "write_csv", "write_json"]


@dataclass(frozen=True)
class Row:
    """How one method did on one noisy mesh.

    Attributes:
        mesh: Name of the clean mesh.
        noise: What follows it in the name of the noisy mesh: ``n1``, ``noisy``, ...
        method: Name of the method, a column of the table.
        theta_deg: Mean angle between the facet normals of the method's mesh and of the clean one, degrees.
        parameters: Everything that decided the result besides the meshes.
        data: Digest of the noisy and the clean file.
        num_faces: Faces of the mesh.
        theta_noisy_deg: The same angle before, degrees.
        theta_normals_deg: The same angle for the normals that the vertices were moved to fit, degrees.
        vertex_error: Mean distance of the vertices from the clean surface, multiples of its mean edge length.
        seconds: Time that the method took, files not counted.
    """

    mesh: str
    noise: str
    method: str
    theta_deg: float
    parameters: str = ""
    data: str = ""
    num_faces: int | None = None
    theta_noisy_deg: float | None = None
    theta_normals_deg: float | None = None
    vertex_error: float | None = None
    seconds: float | None = None


class RowLog:
    """Finished rows, a line of JSON each, so that a benchmark that was cut off goes on where it stood.

    Args:
        path: File to add to; it need not exist. A last line that was cut off counts as not finished.

    Raises:
        DataError: If the file holds something else.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        text = path.read_text() if path.is_file() else ""
        whole, _, rest = text.rpartition("\n")
        if rest:
            write_bytes(path, f"{whole}\n".encode() if whole else b"")
        try:
            self.rows = [Row(**json.loads(line)) for line in whole.splitlines()]
        except (ValueError, TypeError) as error:
            raise DataError(f"Expected finished rows in '{path}' (got {error}): delete it to start afresh") from error

    def find(self, mesh: str, noise: str, method: str, parameters: str, data: str) -> Row | None:
        """The newest row of a method with these parameters on these very files."""
        wanted = (mesh, noise, method, parameters, data)
        found = (row for row in reversed(self.rows) if _identity(row) == wanted)
        return next(found, None)

    def add(self, row: Row) -> None:
        """Write one more row at once."""
        self.rows.append(row)
        with self.path.open("a") as file:
            file.write(json.dumps(asdict(row)) + "\n")


def _identity(row: Row) -> tuple[str, str, str, str, str]:
    return (row.mesh, row.noise, row.method, row.parameters, row.data)


def read_published(path: Path) -> list[Row]:
    """Read results of other methods: columns mesh, noise, method, theta_deg, and where there are, setting and more.

    A method with several settings becomes a method per setting. Rows called ``noisy`` are left out.

    Args:
        path: CSV file; what :func:`write_csv` writes is one.

    Raises:
        DataError: If the file cannot be read, a column is missing or an angle is no number.
    """
    try:
        with path.open(newline="", encoding="utf-8-sig") as file:
            lines = list(csv.DictReader(file))
    except (OSError, UnicodeDecodeError) as error:
        raise DataError(f"Expected a CSV file of results (got '{path}': {error}): check the path") from error
    needed = {"mesh", "noise", "method", "theta_deg"}
    missing = sorted(needed - set(lines[0] if lines else ()))
    if missing:
        raise DataError(
            f"Expected columns {', '.join(sorted(needed))} in '{path}' (got none called {missing[0]}): add it"
        )
    rows = []
    for number, line in enumerate(lines, start=2):
        if line["method"] == "noisy":
            continue
        try:
            theta = float(line["theta_deg"])
        except (TypeError, ValueError) as error:
            reason = f"Expected degrees in '{path}', line {number} (got '{line['theta_deg']}')"
            raise DataError(f"{reason}: write a number, or leave the line out") from error
        method = f"{line['method']} {line.get('setting') or ''}".strip()
        rows.append(Row(line["mesh"], line["noise"], method, theta, f"from {path.name}"))
    return rows


def write_csv(path: Path, rows: Iterable[Row]) -> None:
    """Write rows as CSV, a column per field; empty where a method has no such value."""
    text = io.StringIO()
    writer = csv.DictWriter(text, [field.name for field in fields(Row)], lineterminator="\n")
    writer.writeheader()
    writer.writerows({key: _rounded(value) for key, value in asdict(row).items()} for row in rows)
    write_bytes(path, text.getvalue().encode())


def write_json(path: Path, rows: Sequence[Row], facts: Mapping[str, Any]) -> None:
    """Write rows and the facts of the run (versions, failures, means) as one JSON object."""
    content = {**facts, "rows": [{key: _rounded(value) for key, value in asdict(row).items()} for row in rows]}
    write_bytes(path, (json.dumps(content, indent=1) + "\n").encode())


def _rounded(value: Any) -> Any:
    return round(value, 4) if isinstance(value, float) else value
