"""Denoise a mesh: only vertex positions change, everything else of the file is kept."""

import argparse
import sys
import time
from pathlib import Path

import torch
from rich.console import Console
from rich.progress import Progress
from torch import Tensor

from dnf_pyg.commands.compare import measure, read_reference
from dnf_pyg.denoise import denoise
from dnf_pyg.mesh.geometry import face_normals
from dnf_pyg.mesh.io import read_mesh, write_mesh
from dnf_pyg.metrics import MeanAngularDifference
from dnf_pyg.pretrained import DEFAULT_WEIGHTS, load_network, packaged_weights
from dnf_pyg.report import draw_meshes

__all__ = ["add_arguments", "run"]


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the command's arguments."""
    known = ", ".join(packaged_weights()) or "none in this build"
    parser.add_argument("input", type=Path, metavar="IN", help="noisy mesh (obj, ply, stl, off, glb)")
    parser.add_argument("-o", "--output", type=Path, required=True, metavar="OUT", help="denoised mesh to write")
    parser.add_argument(
        "--weights",
        default=DEFAULT_WEIGHTS,
        metavar="CHECKPOINT_OR_NAME",
        help=f"checkpoint of `dnf-pyg fit`, folder, or packaged name ({known}); default %(default)s",
    )
    parser.add_argument("--reference", type=Path, metavar="CLEAN", help="clean mesh: print theta before and after")
    parser.add_argument("--picture", type=Path, metavar="PNG", help="draw noisy and denoised mesh side by side")
    parser.add_argument("--iterations", type=int, default=20, help="iterations of the vertex update (%(default)s)")
    parser.add_argument("--seed", type=int, default=0, help="seed of the choice of patches (%(default)s)")


def run(options: argparse.Namespace) -> None:
    """Read, denoise with a progress bar, write, and compare if there is a reference."""
    start = time.perf_counter()
    mesh = read_mesh(options.input)
    reference = None if options.reference is None else read_reference(options.reference, mesh)
    net = load_network(options.weights)
    console = Console(stderr=True)
    with Progress(console=console, transient=True) as bar:
        task = bar.add_task("filtering normals", total=mesh.face.size(1))
        result = denoise(
            mesh.mesh,
            net,
            num_iterations=options.iterations,
            seed=options.seed,
            progress=lambda done, total: bar.update(task, completed=done, total=total),
        )
    pos = torch.tensor(result.mesh.vertices, dtype=torch.float64)
    write_mesh(mesh, pos, options.output)
    seconds = time.perf_counter() - start
    sys.stdout.write(f"{options.output}: {mesh.face.size(1)} faces in {seconds:.1f} s\n")
    if reference is not None:
        clean = face_normals(reference.pos, reference.face)
        before = measure(mesh.pos, mesh.face, reference)
        after = measure(pos, mesh.face, reference)
        sys.stdout.write(
            f"theta of the noisy mesh        {before['theta']:7.3f} degrees\n"
            f"theta of the filtered normals  {_theta(result.normal, clean):7.3f} degrees\n"
            f"theta of the denoised mesh     {after['theta']:7.3f} degrees\n"
        )
    if options.picture is not None:
        meshes = {} if reference is None else {"clean": (reference.pos, mesh.face)}
        meshes |= {"noisy": (mesh.pos, mesh.face), "denoised": (pos, mesh.face)}
        draw_meshes(options.picture, meshes, meshes.get("clean"))


def _theta(normal: Tensor, clean_normal: Tensor) -> float:
    metric = MeanAngularDifference()
    metric.update(normal, clean_normal)
    return float(metric.compute())
