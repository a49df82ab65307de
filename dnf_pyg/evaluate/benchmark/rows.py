"""Results of a benchmark, a row per method and noisy mesh, and the files that hold them."""

import csv
import json
from dataclasses import asdict, dataclass
from pathlib import Path

from dnf_pyg.errors import DataError
from dnf_pyg.io.atomic import write_bytes

__all__ = ["Failure", "Row", "RowLog", "read_published", "read_results"]


@dataclass(frozen=True)
class Row:
    """Result of one method on one noisy mesh.

    Attributes:
        mesh: Name of the clean mesh.
        noise: What follows it in the name of the noisy mesh: ``n1``, ``noisy``, ...
        method: Name of the method, a column of the table.
        theta_deg: Mean angle between the facet normals of the method's mesh and of the clean one, degrees.
        parameters: Everything that decided the result besides the meshes.
        data: Digest of the noisy and the clean file.
        num_faces: Faces of the mesh.
        theta_noisy_deg: The same angle for the noisy mesh, degrees.
        theta_normals_deg: The same angle for the normals that the vertices were moved to fit, degrees.
        vertex_error: Mean distance of the vertices from the clean surface, multiples of its mean edge length.
        seconds: Time that the method took, without reading and writing files.
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


@dataclass(frozen=True)
class Failure:
    """A method that gave no result on a mesh.

    Attributes:
        noisy: Name of the noisy mesh.
        method: Name of the method.
        reason: Text of the error.
    """

    noisy: str
    method: str
    reason: str


class RowLog:
    """Finished rows, a line of JSON each, from which an interrupted benchmark continues.

    Args:
        path: File to append to; it need not exist. An incomplete last line is dropped.

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
            raise DataError(f"Expected finished rows in '{path}' (got {error}). Delete it to start afresh.") from error

    def find(self, mesh: str, noise: str, method: str, parameters: str, data: str) -> Row | None:
        """The newest row of a method with these parameters on these very files."""
        wanted = (mesh, noise, method, parameters, data)
        newest_first = reversed(self.rows)
        return next((r for r in newest_first if (r.mesh, r.noise, r.method, r.parameters, r.data) == wanted), None)

    def add(self, row: Row) -> None:
        """Write one more row at once."""
        self.rows.append(row)
        with self.path.open("a") as file:
            file.write(json.dumps(asdict(row)) + "\n")


def read_results(path: Path) -> tuple[list[Row], str]:
    """Read ``results.json`` of `dnf-pyg benchmark`.

    Returns:
        All rows and the name of the test set.

    Raises:
        DataError: If the file cannot be read or holds something else.
    """
    try:
        content = json.loads(path.read_text())
        return [Row(**row) for row in content["rows"]], content["data"]
    except (OSError, ValueError, LookupError, TypeError) as error:
        raise DataError(
            f"Expected results.json of `dnf-pyg benchmark` (got '{path}': {error}). Give the file that it wrote."
        ) from error


def read_published(path: Path) -> list[Row]:
    """Read results of other methods from CSV: columns mesh, noise, method, theta_deg and optionally setting.

    A method with several settings becomes a method per setting. Rows called ``noisy`` are left out, other columns
    ignored.

    Args:
        path: CSV file, such as the ``results.csv`` of a benchmark.

    Raises:
        DataError: If the file cannot be read, a column is missing or an angle is no number.
    """
    try:
        with path.open(newline="", encoding="utf-8-sig") as file:
            lines = list(csv.DictReader(file))
    except (OSError, UnicodeDecodeError) as error:
        raise DataError(f"Expected a CSV file of results (got '{path}': {error}). Check the path.") from error
    needed = {"mesh", "noise", "method", "theta_deg"}
    missing = sorted(needed - set(lines[0] if lines else ()))
    if missing:
        raise DataError(
            f"Expected columns {', '.join(sorted(needed))} in '{path}' (got none called {missing[0]}). Add it."
        )
    rows = []
    for number, line in enumerate(lines, start=2):
        if line["method"] == "noisy":
            continue
        try:
            theta = float(line["theta_deg"])
        except (TypeError, ValueError) as error:
            raise DataError(
                f"Expected degrees in '{path}', line {number} (got '{line['theta_deg']}'). Write a number or leave "
                "the line out."
            ) from error
        method = f"{line['method']} {line.get('setting') or ''}".strip()
        rows.append(Row(line["mesh"], line["noise"], method, theta, f"from {path.name}"))
    return rows
