from itertools import pairwise

import pytest
import torch

from dnf_pyg.nn.kernels import segment

PTR = torch.tensor([0, 2, 2, 5, 6])
REDUCTIONS = {"sum": segment.segment_sum, "mean": segment.segment_mean, "max": segment.segment_max}


def loop(src, ptr, name):
    out = []
    for start, end in pairwise(ptr.tolist()):
        rows = src[start:end]
        out.append(rows.amax(dim=0) if name == "max" and len(rows) else rows.sum(dim=0))
        if name == "mean" and len(rows):
            out[-1] = out[-1] / len(rows)
    return torch.stack(out)


@pytest.mark.parametrize("name", REDUCTIONS)
@pytest.mark.parametrize("with_torch_scatter", [False, True])
def test_values_and_gradients(name, with_torch_scatter, monkeypatch, make):
    if with_torch_scatter:
        pytest.importorskip("torch_scatter")
    monkeypatch.setattr(segment, "WITH_TORCH_SCATTER", with_torch_scatter)
    src = torch.randn(6, 3, requires_grad=True)
    expected = loop(src, PTR, name)
    out = REDUCTIONS[name](src, PTR)
    torch.testing.assert_close(out, expected, rtol=0, atol=1e-12)
    torch.testing.assert_close(make.gradients(out, src), make.gradients(expected, src), rtol=0, atol=1e-12)


@pytest.mark.parametrize("with_torch_scatter", [False, True])
def test_no_rows_at_all(with_torch_scatter, monkeypatch):
    if with_torch_scatter:
        pytest.importorskip("torch_scatter")
    monkeypatch.setattr(segment, "WITH_TORCH_SCATTER", with_torch_scatter)
    for reduction in REDUCTIONS.values():
        assert reduction(torch.zeros(0, 3), torch.zeros(3, dtype=torch.long)).tolist() == [[0.0] * 3] * 2


@pytest.mark.parametrize("name", ["sum", "mean"])
@pytest.mark.parametrize("with_torch_scatter", [False, True])
def test_long_segments_in_half_precision_are_as_exact_as_their_rows(name, with_torch_scatter, monkeypatch):
    if with_torch_scatter:
        pytest.importorskip("torch_scatter")
    monkeypatch.setattr(segment, "WITH_TORCH_SCATTER", with_torch_scatter)
    src = torch.rand(2000, 4, generator=torch.Generator().manual_seed(0)).bfloat16()
    ptr = torch.tensor([0, 800, 2000])
    out = REDUCTIONS[name](src, ptr)
    assert out.dtype == torch.bfloat16
    torch.testing.assert_close(out.double(), loop(src.double(), ptr, name), rtol=2**-8, atol=0)
