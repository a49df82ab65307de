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


def test_candidates_are_weighed_by_a_softmax(make):
    head, x = make.scramble(NormalHead(8, num_candidates=2)).eval(), torch.randn(5, 8)
    candidates = torch.nn.functional.normalize(torch.randn(5, 2, 3), dim=2)
    with torch.no_grad():
        head.lins[-1].weight.zero_()
        head.lins[-1].bias.copy_(torch.tensor([0.1, 0.2, 0.3, 1.0, 3.0]))
    share = 1 / (1 + torch.tensor(2.0, dtype=x.dtype).exp())
    expected = torch.tensor([0.1, 0.2, 0.3]) + share * candidates[:, 0] + (1 - share) * candidates[:, 1]
    torch.testing.assert_close(head(x, candidates), torch.nn.functional.normalize(expected, dim=1))
