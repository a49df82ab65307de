"""Processor seconds from a cold start: imports, help, typing errors, and a mesh of 10,000 faces.

Every row is the median of several processes. The bars are those of a quiet machine with two cores, and the mesh is
denoised with the weights ``single``.
"""

import os
import statistics
import subprocess
import sys
import tempfile
from pathlib import Path

NUM_RUNS = 3
DNF = [sys.executable, "-m", "dnf_pyg"]
SMALL = {"--help": ["--help"], "--version": ["--version"], "a typing error": ["denoize"], "configs": ["configs"],
         "weights": ["weights"], "completion": ["completion", "bash"]}  # fmt: skip
BARS = {"import dnf_pyg": 1.2, "small": 0.4, "denoise": 4.0}  # the first in times of importing torch, others in seconds


def processor_seconds(words):
    """User and system time of a process and its children."""
    before = os.times()
    subprocess.run(words, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, check=False)
    after = os.times()
    return after.children_user + after.children_system - before.children_user - before.children_system


def median(words, num_runs=NUM_RUNS):
    processor_seconds(words)  # files into memory, compiled code onto the disk
    return statistics.median(processor_seconds(words) for _ in range(num_runs))


def main():
    codes = {name: f"import {name}" for name in ("torch", "torch_geometric", "dnf_pyg")}
    codes["dnf_pyg.denoise"] = "from dnf_pyg import denoise"
    imports = {name: [] for name in codes}
    for _ in range(NUM_RUNS + 1):  # in turn, so that a ratio compares the same minutes
        for name, code in codes.items():
            imports[name].append(processor_seconds([sys.executable, "-c", code]))
    seconds = {name: statistics.median(values[1:]) for name, values in imports.items()}
    print(f"\n{'from a cold start':<32} processor seconds\n{'-' * 62}")
    for name, value in seconds.items():
        bar = "" if name != "dnf_pyg" else f"   at most {BARS['import dnf_pyg'] * seconds['torch']:.2f}"
        print(f"{codes[name]:<32} {value:8.2f}  {value / seconds['torch']:5.2f} x torch{bar}")
    for name, words in SMALL.items():
        print(f"{'dnf-pyg ' + name:<32} {median([*DNF, *words]):8.2f}   at most {BARS['small']}")
    with tempfile.TemporaryDirectory() as folder:
        clean, noisy, output = (str(Path(folder) / f"{name}.ply") for name in ("clean", "noisy", "output"))
        processor_seconds([*DNF, "make-shape", "blob", "-o", clean, "--faces", "10000"])
        processor_seconds([*DNF, "add-noise", clean, "-o", noisy])
        value = median([*DNF, "denoise", noisy, "-o", output, "--overwrite", "--weights", "single"], 3)
        assert Path(output).is_file()
    print(f"{'dnf-pyg denoise, 10,000 faces':<32} {value:8.2f}   at most {BARS['denoise']}")


if __name__ == "__main__":
    main()
