"""Time of small networks that could be students of ``single`` for a faster ``--fast``: ``measure_students.py [FACES]``.

The networks have random weights, since time does not depend on them. Seconds are processor seconds of one thread for
100,000 faces, the fewest of two runs; only their ratios can be compared between machines. ``patches`` is the part of
them that cuts patches, which depends on the neighbours alone.
"""

import sys
import time

import torch
import trimesh

from dnf_pyg import FAST, FilterOptions, load_network
from dnf_pyg.evaluate.benchmark.tables import markdown_table
from dnf_pyg.filtering import filter_normals
from dnf_pyg.mesh.noise import GaussianNormalNoise
from dnf_pyg.nn import SurfaceDNFNet
from dnf_pyg.patches import PatchExtractor, cover

SMALL = FilterOptions(coverage=1, batch_size=16)  # calls of small networks cost more than their arithmetic
LEVELS = {"k": (8, 16, 16), "channels": (32, 64, 64), "residual_k": 8, "bilateral_iterations": 6}
STUDENTS = {
    "three levels, two units": {**LEVELS, "embedding_channels": 64},
    "three levels": {**LEVELS, "embedding_channels": 64, "num_units": 1},
    "three levels, narrow end": {**LEVELS, "embedding_channels": 32, "num_units": 1},
    "three levels, more neighbours": {**LEVELS, "k": (8, 16, 24), "embedding_channels": 64, "num_units": 1},
    "two levels": {**LEVELS, "k": (8, 16), "channels": (32, 64), "embedding_channels": 64, "num_units": 1},
}


def processor_seconds(function):
    """The fewest of two runs."""
    found = []
    for _ in range(2):
        start = time.process_time()
        function()
        found.append(time.process_time() - start)
    return min(found)


def main():
    torch.manual_seed(0)
    torch.set_num_threads(1)
    num_faces = int(sys.argv[1]) if sys.argv[1:] else 100_000
    sections = round((num_faces / 2 * 0.8) ** 0.5)
    ring = trimesh.creation.torus(1.0, 0.4, major_sections=round(num_faces / 2 / sections), minor_sections=sections)
    pos, face = torch.tensor(ring.vertices), torch.tensor(ring.faces).t().contiguous()
    pos = GaussianNormalNoise()(pos, face, 0.2, torch.Generator().manual_seed(0))
    single = load_network("single")
    rows = {"single": (single, FilterOptions()), "single, `--fast`": (single, FAST)}
    rows |= {title: (SurfaceDNFNet(**arguments).eval(), SMALL) for title, arguments in STUDENTS.items()}

    def cut(net, options):
        for _ in cover(PatchExtractor(pos, face, patch_size=800, k=max(net.k)), min_coverage=options.coverage):
            pass

    scale, lines, unit = 1e5 / face.size(1), [], 0.0
    for net, options in rows.values():  # compilation and first touch
        filter_normals(net, pos, face[:, :900], options)
    for title, (net, options) in rows.items():
        total = scale * processor_seconds(lambda net=net, options=options: filter_normals(net, pos, face, options))
        patches = scale * processor_seconds(lambda net=net, options=options: cut(net, options))
        unit = total if title == "best, `--fast`" else unit
        ratio = f"{total / unit:.2f}" if unit else ""
        parameters = sum(parameter.numel() for parameter in net.parameters())
        lines.append([title, f"{parameters:,}", f"{patches:.2f}", f"{total - patches:.2f}", f"{total:.2f}", ratio])
    print(markdown_table(["network", "parameters", "patches", "network", "both", "of `--fast`"], lines))


if __name__ == "__main__":
    main()
