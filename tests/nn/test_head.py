import torch

from dnf_pyg.nn import NormalHead


def test_unit_vectors_of_the_mlp(loops, make):
    head = make.scramble(NormalHead(8)).eval()
    x = torch.randn(5, 8)
    *hidden, last = head.lins
    h = list(x)
    for lin, norm in zip(hidden, head.norms, strict=True):
        h = [row.clamp(min=0) for row in loops.normalize([lin.weight @ row + lin.bias for row in h], norm.module)]
    expected = torch.stack([last.weight @ row + last.bias for row in h])
    torch.testing.assert_close(head(x), expected / expected.norm(dim=1, keepdim=True))


def test_full_precision_under_autocast():
    head, x = NormalHead(8).float().eval(), torch.randn(5, 8).bfloat16()
    with torch.autocast("cpu", torch.bfloat16):
        out = head(x)
    torch.testing.assert_close(out, head(x.float()), rtol=0, atol=0)
