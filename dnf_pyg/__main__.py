"""Runs the command line program as ``python -m dnf_pyg``."""

import sys

from dnf_pyg.cli import main

__all__: list[str] = []

if __name__ == "__main__":
    sys.exit(main())
