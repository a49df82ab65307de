"""Tables as text: markdown to read, CSV to compute with."""

import csv
import io
from collections.abc import Iterable, Mapping, Sequence

from dnf_pyg.evaluate.benchmark.rows import Failure

__all__ = ["bold_lowest", "csv_table", "document", "markdown_table", "number"]


def number(value: float | None, digits: int = 3, bold: bool = False) -> str:
    """Format a cell; no value gives an empty one."""
    if value is None:
        return ""
    return f"**{value:.{digits}f}**" if bold else f"{value:.{digits}f}"


def bold_lowest(values: Sequence[float | None]) -> list[str]:
    """Format cells, the lowest in bold.

    Example:
        >>> bold_lowest([2.0, None, 1.0])
        ['2.000', '', '**1.000**']
    """
    lowest = min((value for value in values if value is not None), default=None)
    return [number(value, bold=value == lowest) for value in values]


def markdown_table(header: Sequence[str], lines: Iterable[Sequence[str]]) -> str:
    """Lay out a table, the first column aligned to the left, the others to the right."""
    rule = ["---", *["---:"] * (len(header) - 1)]
    escaped = ([cell.replace("|", "\\|") for cell in line] for line in [header, rule, *lines])
    return "\n".join(f"| {' | '.join(cells)} |" for cells in escaped)


def csv_table(header: Sequence[str], lines: Iterable[Iterable[object]]) -> str:
    """Lay out a table as CSV: numbers with four decimals at most, empty where there is no value."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(header)
    writer.writerows([round(value, 4) if isinstance(value, float) else value for value in line] for line in lines)
    return text.getvalue()


def document(
    title: str, paragraphs: Sequence[str], sections: Mapping[str, str], failures: Sequence[Failure] = ()
) -> str:
    """Join paragraphs, sections by their headings, and a list of failures into one markdown text."""
    parts = [f"# {title}", *paragraphs, *(f"## {heading}\n\n{text}" for heading, text in sections.items())]
    if failures:
        parts.append("## Failures\n\n" + "\n".join(f"- {f.noisy}, {f.method}: {f.reason}" for f in failures))
    return "\n\n".join(parts) + "\n"
