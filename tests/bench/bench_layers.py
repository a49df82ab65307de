"""Time and memory of the network on 800-face patches: plain PyG formulation, ours, and the bare matrix products."""

import argparse
import ctypes
import statistics
import time
from collections.abc import Callable
from pathlib import Path

import torch
from torch_geometric.nn import EdgeConv

from dnf_pyg.nn import DNFNet
from dnf_pyg.nn.neighbors import sort_by_center

FACES = 800
PRECISIONS = {"fp32": torch.float32, "bf16": torch.bfloat16}
SETTINGS = {"K=50": (10, 30, 50), "K=150": (50, 100, 150)}


class PlainConv(torch.nn.Module):
    """PyG's EdgeConv with the same MLP and its default aggregation."""

    def __init__(self, conv):
        super().__init__()
        self.conv, self.k = EdgeConv(conv.mlp), conv.k

    def forward(self, x, edge_index):
        return self.conv(x, sort_by_center(edge_index, (x.size(0), x.size(0)), self.k).as_tensor())


def plain(net):
    """The same network on PyG's EdgeConv."""
    net.embedding.convs = torch.nn.ModuleList(PlainConv(conv) for conv in net.embedding.convs)
    for unit in net.units:
        unit.conv = PlainConv(unit.conv)
    return net


def patches(num_patches, k, device):
    """Normals and edges to the k faces of nearby number, patch after patch."""
    generator = torch.Generator().manual_seed(0)
    num_faces = num_patches * FACES
    normal = torch.nn.functional.normalize(torch.randn(num_faces, 3, generator=generator), dim=1)
    offset = torch.cat([torch.zeros(1, dtype=torch.long), torch.randperm(2 * k, generator=generator)[: k - 1] - k])
    face, start = torch.arange(num_faces).view(-1, 1) % FACES, torch.arange(num_faces).view(-1, 1) // FACES * FACES
    neighbor = (face + offset) % FACES + start
    edge_index = torch.stack([neighbor.flatten(), torch.arange(num_faces).repeat_interleave(k)])
    return normal.to(device), edge_index.to(device), start.flatten().div(FACES).long().to(device)


def products(net, num_patches):
    """Rows, inner and outer size of each matrix product of the factored network."""
    faces = num_patches * FACES
    out = [(faces, 451, 128), *[(FACES, 128, FACES)] * (num_patches * net.num_units)]
    for head in net.heads:
        out += [(faces, lin.in_channels, lin.out_channels) for lin in head.lins]
    for conv, k in [*((c, c.k) for c in net.embedding.convs), *((u.conv, u.k) for u in net.units)]:
        first, *rest = conv.mlp.lins
        out += [(faces, conv.in_channels, first.out_channels)] * 2
        out += [(faces * k, lin.in_channels, lin.out_channels) for lin in rest]
    return out


def floor(net, num_patches, device, dtype, training):
    """Run the bare products: in training the two of the backward pass as well."""
    arrays = []
    for m, k, n in products(net, num_patches):
        a, b, c = (torch.randn(s, device=device).to(dtype) for s in ((m, k), (k, n), (m, n)))
        arrays.append((a, b, c))
        if training:
            arrays += [(c, b.t(), torch.empty_like(a)), (a.t(), c.clone(), torch.empty_like(b))]

    def run():
        for a, b, out in arrays:
            torch.mm(a, b, out=out)

    return run


def step(net, inputs, dtype, training):
    """One forward pass without gradients, or one training step without the optimizer."""
    normal, edge_index, batch = inputs
    net.train(training)

    def run():
        net.zero_grad()
        with (
            torch.autocast(normal.device.type, dtype, enabled=dtype != torch.float32),
            torch.set_grad_enabled(training),
        ):
            if not training:
                return net(normal, edge_index, batch)
            stages = net.stages(normal, edge_index, batch)
            loss = sum((f - normal).square().sum(1).mean() + r.square().sum(1).mean() for f, r in stages)
        loss.backward()
        return None

    return run


def seconds(run, device):
    """Wall and processor time; the latter, with one thread, is what a busy machine leaves comparable."""
    if device == "cuda":
        torch.cuda.synchronize()
    wall, processor = time.perf_counter(), time.process_time()
    run()
    if device == "cuda":
        torch.cuda.synchronize()
    return time.perf_counter() - wall, time.process_time() - processor


def peak_megabytes(run: Callable, device: str) -> float:
    """Memory that a run needs beyond what is held before it."""
    if device == "cuda":
        torch.cuda.reset_peak_memory_stats()
        before = torch.cuda.memory_allocated()
        run()
        return (torch.cuda.max_memory_allocated() - before) / 2**20
    ctypes.CDLL("libc.so.6").malloc_trim(0)  # what was freed before must not serve this run unseen
    Path("/proc/self/clear_refs").write_text("5")  # the high-water mark starts anew
    before = _status("VmRSS")
    run()
    return (_status("VmHWM") - before) / 2**10


def _status(name):
    lines = Path("/proc/self/status").read_text().splitlines()
    return int(next(line for line in lines if line.startswith(name)).split()[1])


def table(title, k, num_patches, device, training, repeats, precisions):
    inputs = patches(num_patches, max(k), device)
    torch.manual_seed(0)
    ours, stock = DNFNet(k=k).to(device), plain(DNFNet(k=k)).to(device)
    runs = {"plain EdgeConv, fp32": step(stock, inputs, torch.float32, training)}
    for name in precisions:
        runs[f"ours, {name}"] = step(ours, inputs, PRECISIONS[name], training)
        runs[f"bare products, {name}"] = floor(ours, num_patches, device, PRECISIONS[name], training)
    for run in runs.values():
        run()
    times = {name: [] for name in runs}
    for _ in range(repeats):  # in turns, so that a busy machine is busy for all
        for name, run in runs.items():
            times[name].append(seconds(run, device))
    wall, processor = ({n: statistics.median(t[i] for t in times[n]) for n in runs} for i in (0, 1))
    # ratios are of wall time, but with one thread on a CPU of processor time
    clock = wall if torch.get_num_threads() > 1 or device == "cuda" else processor
    print(f"\n{title}, {num_patches} patch(es), {device}, {torch.get_num_threads()} thread(s), median of {repeats}")
    print(f"{'':22s}{'wall ms':>10s}{'cpu ms':>10s}{'vs plain':>10s}{'vs floor':>10s}{'extra MB':>10s}", flush=True)
    for name, run in runs.items():
        own_floor = clock.get(f"bare products, {name[-4:]}", float("nan"))
        ratios = clock["plain EdgeConv, fp32"] / clock[name], clock[name] / own_floor
        memory = "" if name.startswith("bare") else f"{peak_megabytes(run, device):10.0f}"
        per_patch = [1e3 * value[name] / num_patches for value in (wall, processor)]
        print(
            f"{name:22s}{per_patch[0]:10.1f}{per_patch[1]:10.1f}{ratios[0]:9.2f}x{ratios[1]:9.2f}x{memory}", flush=True
        )


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--repeats", type=int, default=7)
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--settings", nargs="+", default=list(SETTINGS), choices=SETTINGS)
    parser.add_argument("--precisions", nargs="+", default=list(PRECISIONS), choices=PRECISIONS)
    arguments = parser.parse_args()
    torch.set_num_threads(arguments.threads)
    for name in arguments.settings:
        k = SETTINGS[name]
        for training in (False, True):
            title = f"{name} {k}, {'training step' if training else 'inference'}"
            table(title, k, 1, "cpu", training, arguments.repeats, arguments.precisions)
            for num_patches in (10, 64) if torch.cuda.is_available() else ():
                table(title, k, num_patches, "cuda", training, arguments.repeats, arguments.precisions)


if __name__ == "__main__":
    main()
