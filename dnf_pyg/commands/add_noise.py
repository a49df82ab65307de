"""Add noise to a clean mesh; its level is a multiple of the mean edge length."""

import argparse
from pathlib import Path

import torch

from dnf_pyg.commands.settings import not_negative
from dnf_pyg.io import read_mesh, write_mesh
from dnf_pyg.mesh.noise import NOISE_KINDS

__all__ = ["add_arguments", "run"]


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the command's arguments."""
    parser.add_argument("clean", type=Path, metavar="CLEAN", help="mesh to add noise to (obj, ply, stl, off, glb)")
    parser.add_argument("-o", "--output", type=Path, required=True, metavar="NOISY", help="mesh to write")
    parser.add_argument("--kind", choices=sorted(NOISE_KINDS), default="gaussian", help="noise model (%(default)s)")
    parser.add_argument(
        "--level", type=not_negative, default=0.2, help="multiple of the mean edge length (%(default)s)"
    )
    parser.add_argument("--seed", type=int, default=0, help="the same seed gives the same noise (%(default)s)")


def run(options: argparse.Namespace) -> None:
    """Read, move the vertices, write."""
    mesh = read_mesh(options.clean)
    generator = torch.Generator().manual_seed(options.seed)
    pos = NOISE_KINDS[options.kind]()(mesh.pos, mesh.face, options.level, generator)
    write_mesh(mesh, pos, options.output)
