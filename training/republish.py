"""Write packaged weights again, with what a benchmark measured.

``python training/republish.py RESULTS.json NAME[=CHECKPOINT] ...`` keeps the text of each card, which is edited by
hand, and takes the networks of a checkpoint where one is given.
"""

import re
import sys
import tempfile
from pathlib import Path

import dnf_pyg.weights
from dnf_pyg.commands.export_weights import run
from dnf_pyg.commands.options import ExportOptions
from dnf_pyg.weights.release import read_release

CARD = re.compile(
    r"\n## Training data and credits\n\n(?P<sources>.*?)\n\n## Recipe\n\n(?P<recipe>.*?)\n\n## Measured\n", re.DOTALL
)


def main(results: Path, names: list[str]) -> None:
    """Write the folders of all names."""
    for word in names:
        name, _, checkpoint = word.partition("=")
        folder = Path(dnf_pyg.weights.__file__).parent / name
        card = CARD.search((folder / "README.md").read_text())
        if card is None:
            raise SystemExit(f"Expected the card of released weights (got {folder / 'README.md'}).")
        with tempfile.TemporaryDirectory() as texts:
            for part in ("sources", "recipe"):
                Path(texts, f"{part}.md").write_text(card[part])
            run(
                ExportOptions(
                    checkpoint or name,
                    output=folder,
                    description=read_release(folder).description,
                    sources=Path(texts, "sources.md"),
                    recipe=Path(texts, "recipe.md"),
                    benchmark=results,
                )
            )


if __name__ == "__main__":
    main(Path(sys.argv[1]), sys.argv[2:])
