"""Options of the commands, as dataclasses; those of groups are in other modules named ``..._options``.

The command line, its help and YAML files follow from them (:mod:`dnf_pyg.commands.parser`). They do not import what the
commands work with, so that the help and errors of the command line appear at once.
"""

from dataclasses import KW_ONLY, asdict, dataclass, field
from pathlib import Path
from typing import Literal

from dnf_pyg.options import DEFAULT_WEIGHTS, FAST, Direction, FilterOptions, UpdateOptions, check_range, expert

__all__ = [
    "CompareOptions",
    "CompletionOptions",
    "ConfigsOptions",
    "DenoiseOptions",
    "ExportOptions",
    "PredictOptions",
    "WeightsOptions",
]

_FAST = {"weights": "small", **asdict(FAST)}


@dataclass(frozen=True)
class DenoiseOptions:
    """Denoise meshes: only vertex positions change, everything else of a file is kept.

    Examples:
        dnf-pyg denoise noisy.obj
        dnf-pyg denoise noisy.obj -o smooth.ply --strength 0.7 --preserve_boundary
        dnf-pyg denoise scans -o denoised --fast
        dnf-pyg denoise noisy.obj --reference clean.obj --report report.html

    Args:
        input: Noisy meshes (obj, ply, stl, off, glb, gltf), or folders of them.
        output: Mesh to write, in the format of its ending, or an existing folder. NAME_denoised.EXT beside a single
            input if not given.
        overwrite: Replace outputs that exist. Otherwise they are an error; of several inputs, those are skipped.
        weights: Checkpoint of `dnf-pyg fit`, folder, or name of packaged weights (see `dnf-pyg weights`).
        data_set: Data set of a joint training whose statistics are used, if the checkpoint holds those of several.
        fast: A quarter of the time for 0.2 degrees on average (weights small, coverage 1, k 10 16 24).
        num_passes: Number of times the network filters the normals, each time those of its own result. Two passes
            suit noise of more than 0.5 mean edge lengths.
        mask: Vertices that may move: a .txt or .npy file with a number per vertex or triangle, 0 for those that stay;
            or the name of such a property of a ply, glb or gltf mesh.
        reference: Clean mesh with the same faces, to print theta before and after.
        picture: PNG file to draw: both meshes side by side and, with a reference, their error maps.
        report: HTML page to write, with both meshes in 3D, histograms and figures; with several inputs, an existing
            folder for their pages and an index.html of them.
        view: Direction that the picture and the page show the meshes from; auto chooses one that suits them.
        json: Print one JSON object per mesh.
        threads: CPU threads of the network; as many as cores if not given.
    """

    input: tuple[Path, ...]
    _: KW_ONLY
    output: Path | None = None
    overwrite: bool = False
    weights: str = DEFAULT_WEIGHTS
    data_set: str | None = None
    fast: bool = field(default=False, metadata={"preset": _FAST})
    update: UpdateOptions = UpdateOptions()
    num_passes: int = 1
    mask: str | None = None
    reference: Path | None = None
    picture: Path | None = None
    report: Path | None = None
    view: Direction = "auto"
    json: bool = False
    filtering: FilterOptions = FilterOptions()
    threads: int | None = expert(None)

    def __post_init__(self) -> None:
        check_range("num_passes", self.num_passes, int, 1, float("inf"))
        if self.threads is not None:
            check_range("threads", self.threads, int, 1, float("inf"))


@dataclass(frozen=True)
class PredictOptions:
    """Denoise many meshes on several processes or machines.

    Examples:
        dnf-pyg predict scans -o denoised --trainer.devices 2
        torchrun --nproc_per_node 1 --nnodes 2 ... dnf-pyg predict scans -o denoised --trainer.num_nodes 2

    Outputs appear whole or not at all, and existing ones are skipped: start an interrupted run again to continue it.
    Machines have to see the same folders.

    Args:
        input: Noisy meshes (obj, ply, stl, off, glb, gltf), or folders of them.
        output: Folder for the results.
        overwrite: Replace outputs that exist; otherwise these inputs are skipped.
        weights: Checkpoint of `dnf-pyg fit`, folder, or name of packaged weights (see `dnf-pyg weights`).
        data_set: Data set of a joint training whose statistics are used, if the checkpoint holds those of several.
        fast: A quarter of the time for 0.2 degrees on average (weights small, coverage 1, k 10 16 24).
        num_passes: Number of times the network filters the normals, each time those of its own result.
        json: Print one JSON object per mesh.
    """

    input: tuple[Path, ...]
    _: KW_ONLY
    output: Path
    overwrite: bool = False
    weights: str = DEFAULT_WEIGHTS
    data_set: str | None = None
    fast: bool = field(default=False, metadata={"preset": _FAST})
    update: UpdateOptions = UpdateOptions()
    num_passes: int = 1
    json: bool = False
    filtering: FilterOptions = field(default=FilterOptions(), metadata={"skip": ("device",)})

    def __post_init__(self) -> None:
        check_range("num_passes", self.num_passes, int, 1, float("inf"))


@dataclass(frozen=True)
class CompareOptions:
    """Measure a mesh against its clean reference: theta in degrees, E_v, faces within 5 and 10 degrees.

    Examples:
        dnf-pyg compare denoised.obj clean.obj

    Args:
        mesh: Mesh to measure.
        reference: Clean mesh with the same faces.
        json: Print one JSON object.
    """

    mesh: Path
    reference: Path
    _: KW_ONLY
    json: bool = False


@dataclass(frozen=True)
class WeightsOptions:
    """List the packaged weights and verify their checksums.

    Examples:
        dnf-pyg weights
        dnf-pyg weights export --help
    """


@dataclass(frozen=True)
class ExportOptions:
    """Write a checkpoint as a folder to be released: safetensors, config.json, model card and checksums.

    Examples:
        dnf-pyg weights export best.ckpt -o mine --description "For scans" --sources data.md --recipe config.yaml

    Args:
        checkpoint: Checkpoint of `dnf-pyg fit`, folder, or name of packaged weights.
        data_set: Data set of a joint training whose statistics are used, if the checkpoint holds those of several.
        output: Folder to write; its name becomes the name of the weights.
        description: What the weights are for, a paragraph.
        sources: Markdown file with training data, licences and credits.
        recipe: Config or markdown file that tells how they were trained.
        licence: SPDX identifier of the licence.
        benchmark: The results.json of `dnf-pyg benchmark` with these weights.
    """

    checkpoint: str
    _: KW_ONLY
    output: Path
    description: str
    sources: Path
    recipe: Path
    data_set: str | None = None
    licence: str = "MIT"
    benchmark: Path | None = None


@dataclass(frozen=True)
class ConfigsOptions:
    """List the packaged configs, print one, or copy one to edit it.

    Examples:
        dnf-pyg configs
        dnf-pyg configs synthetic -o mine.yaml

    Args:
        name: Config to print, or to copy with -o.
        output: File to copy it to.
    """

    name: str | None = None
    _: KW_ONLY
    output: Path | None = None


@dataclass(frozen=True)
class CompletionOptions:
    """Print a script for the shell that completes commands and options when Tab is pressed.

    Examples:
        eval "$(dnf-pyg completion bash)"

    Args:
        shell: Shell that reads it.
    """

    shell: Literal["bash", "zsh"]
