"""Options of the commands that measure methods on a test set, as dataclasses (see :mod:`dnf_pyg.commands.options`)."""

from dataclasses import KW_ONLY, dataclass, field
from pathlib import Path
from typing import Literal

from dnf_pyg.options import DEFAULT_WEIGHTS, FilterOptions, UpdateOptions, check_range, expert

__all__ = [
    "AblationOptions",
    "BenchmarkOptions",
    "EvaluationOptions",
    "MethodOptions",
    "SeriesOptions",
]


@dataclass(frozen=True)
class EvaluationOptions:
    """Denoise the meshes of a test set.

    Args:
        data: Folder with original/NAME.obj and noisy/NAME_n1.obj, or a folder above it.
        output: Folder for the results.
        meshes: Names of the meshes to use, such as block or '*_n3'; all if not given.
        limit: Use only the first meshes, as many as this.
        num_passes: Number of times a network filters the normals, each time those of its own result.
    """

    data: Path
    _: KW_ONLY
    output: Path
    meshes: tuple[str, ...] | None = field(default=None, metadata={"metavar": "PATTERN"})
    limit: int | None = None
    update: UpdateOptions = field(default=UpdateOptions(), metadata={"skip": ("max_excess",)})
    num_passes: int = 1
    filtering: FilterOptions = FilterOptions()

    def __post_init__(self) -> None:
        check_range("num_passes", self.num_passes, int, 1, float("inf"))
        if self.limit is not None:
            check_range("limit", self.limit, int, 1, float("inf"))


@dataclass(frozen=True, kw_only=True)
class MethodOptions(EvaluationOptions):
    """Compare networks and classical filters on a test set.

    Args:
        weights: Networks to compare: checkpoints, folders, or names of packaged weights, each with a title if wanted.
        baselines: Classical filters to compare with; none if no name follows.
        filter_update: Vertex update after a classical filter: that of the networks, as in the paper, or the filter's
            own, with a fixed number of iterations.
    """

    weights: tuple[str, ...] = field(default=(DEFAULT_WEIGHTS,), metadata={"metavar": "[TITLE=]WEIGHTS"})
    baselines: tuple[str, ...] = field(
        default=("BNF", "GNF"), metadata={"metavar": "NAME", "choices": "dnf_pyg.evaluate.baselines:BASELINES"}
    )
    filter_update: Literal["shared", "own"] = expert("shared")


@dataclass(frozen=True, kw_only=True)
class BenchmarkOptions(MethodOptions):
    """Compare methods on a folder of test meshes: tables (markdown, CSV, JSON) and plots.

    Examples:
        dnf-pyg benchmark data/cnr/Synthetic -o results
        dnf-pyg benchmark data/cnr/Synthetic -o results --weights best ours=runs/best.ckpt --baselines BNF

    An interrupted run continues when it is started again with the same output folder. Results are computed again for
    other weights, options or meshes. After a change of the code, use another folder.

    Args:
        outputs: Folders of meshes that other methods made, under the names of the noisy meshes.
        published: CSV files with theta of other methods: columns mesh, noise, method, theta_deg and, optionally,
            setting.
        keep: Meshes whose denoised versions are written and drawn.
    """

    baselines: tuple[str, ...] = field(
        default=("BNF", "GNF", "TV", "L0", "Taubin"),
        metadata={"metavar": "NAME", "choices": "dnf_pyg.evaluate.baselines:BASELINES"},
    )
    outputs: tuple[str, ...] = field(default=(), metadata={"metavar": "TITLE=FOLDER"})
    published: tuple[Path, ...] = field(default=(), metadata={"metavar": "CSV"})
    keep: tuple[str, ...] = field(default=(), metadata={"metavar": "PATTERN"})


@dataclass(frozen=True)
class _Series:
    """The first argument of :class:`SeriesOptions`.

    Args:
        series: Property to vary.
    """

    series: str = field(metadata={"choices": "dnf_pyg.evaluate.experiments:SERIES"})


@dataclass(frozen=True, kw_only=True)
class SeriesOptions(MethodOptions, _Series):
    """Robustness to a property of the mesh or of its noise.

    Examples:
        dnf-pyg experiment series noise-levels data/cnr/Synthetic -o noise_levels --settings 0.1 0.3

    The first of the default networks is that of the paper, trained on Gaussian noise of 0.1 to 0.3.

    Args:
        settings: Settings of the series to run; all if not given.
    """

    weights: tuple[str, ...] = field(default=("synthetic", DEFAULT_WEIGHTS), metadata={"metavar": "[TITLE=]WEIGHTS"})
    settings: tuple[str, ...] | None = field(default=None, metadata={"metavar": "SETTING"})


@dataclass(frozen=True, kw_only=True)
class AblationOptions(EvaluationOptions):
    """Table 1: the network without each of its parts, beside the figures of the paper.

    Examples:
        dnf-pyg experiment ablation data/cnr/Synthetic -o ablation

    Args:
        runs: Folder with the runs of the configs ablation_*.yaml and synthetic.yaml.
        weights: Weights of a case in place of those in the folder of runs.
    """

    runs: Path = Path("runs")
    weights: tuple[str, ...] = field(default=(), metadata={"metavar": "CASE=WEIGHTS"})
