"""Make a clean mesh in code, to try things on."""

import argparse
from pathlib import Path

import torch
import trimesh

from dnf_pyg.commands.settings import count
from dnf_pyg.io import write_mesh
from dnf_pyg.synthetic.shapes import SHAPES

__all__ = ["add_arguments", "run"]


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the command's arguments."""
    parser.add_argument("kind", choices=sorted(SHAPES), help="kind of shape; its details are drawn at random")
    parser.add_argument("-o", "--output", type=Path, required=True, metavar="OUT", help="mesh to write")
    parser.add_argument("--faces", type=count, default=8000, help="about how many faces (%(default)s)")
    parser.add_argument("--seed", type=int, default=0, help="the same seed gives the same mesh (%(default)s)")


def run(options: argparse.Namespace) -> None:
    """Make and write one shape."""
    pos, face = SHAPES[options.kind](torch.Generator().manual_seed(options.seed), options.faces)
    write_mesh(trimesh.Trimesh(pos.numpy(), face.t().numpy(), process=False), pos, options.output)
