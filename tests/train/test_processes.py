"""Processes that worked together end in good order: none of their threads meets the end of the interpreter."""

import subprocess
import sys
import textwrap
from pathlib import Path

import pytest

SCRIPT = textwrap.dedent(
    """
    import atexit, pathlib, sys

    def threads():
        return [path.read_text() for path in pathlib.Path("/proc/self/task").glob("*/comm")].count("pt_gloo_runloop\\n")

    atexit.register(lambda: print(threads()))  # registered first: called last
    import torch
    from dnf_pyg.nn import DNFNet
    from dnf_pyg.train.prediction import MeshDenoisingModule

    rank = int(sys.argv[1])
    torch.distributed.init_process_group("gloo", init_method=f"file://{sys.argv[2]}", rank=rank, world_size=2)
    module = MeshDenoisingModule(DNFNet(k=(3, 4, 5), channels=(8, 8, 8), embedding_channels=8, residual_k=3))
    module.setup("predict")
    module.failures[f"mesh{rank}"] = "broken"
    print(threads())
    sys.setswitchinterval(100)  # a thread that waits for the interpreter gets it when the process ends
    print(*sorted(module.failures_of_all()))
    """
)


@pytest.mark.skipif(not Path("/proc/self/task").is_dir(), reason="threads are counted in /proc, which only Linux has")
def test_no_thread_of_a_group_is_left_at_the_end(tmp_path):
    command = [sys.executable, "-c", SCRIPT]
    both = [
        subprocess.Popen([*command, str(rank), str(tmp_path / "store")], stdout=subprocess.PIPE, stderr=subprocess.PIPE)
        for rank in range(2)
    ]
    for process in both:
        out, error = process.communicate(timeout=900)
        assert process.returncode == 0, error.decode()
        before, failures, after = out.decode().splitlines()
        assert int(before) > 0
        assert failures == "mesh0 mesh1"
        assert int(after) == 0
