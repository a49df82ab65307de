import pytest
import torch

from dnf_pyg.train.losses import JointLoss, NormalDistance, SquaredNormalDistance


@pytest.fixture
def stages():
    generator = torch.Generator().manual_seed(0)
    return [
        (
            torch.nn.functional.normalize(torch.randn(7, 3, generator=generator), dim=-1),
            torch.randn(7, 5, generator=generator),
        )
        for _ in range(2)
    ]


def test_matches_loop_over_patches_of_different_size(stages):
    clean = torch.nn.functional.normalize(torch.arange(21.0).view(7, 3) - 9.5, dim=-1)
    batch = torch.tensor([0, 0, 0, 0, 0, 1, 1])
    expected = 0.0
    for patch in range(2):
        rows = (batch == patch).nonzero().flatten().tolist()
        for normal, feature in stages:
            expected += sum(float((normal[i] - clean[i]).square().sum()) for i in rows) / len(rows) / 2
            expected += 0.5 * sum(float(feature[i].square().sum()) for i in rows) / len(rows) / 2
    assert float(JointLoss(alpha=0.5)(stages, clean, batch).total) == pytest.approx(expected, rel=1e-6)


def test_no_batch_is_one_patch(stages):
    clean = stages[0][0]
    torch.testing.assert_close(
        torch.stack(JointLoss()(stages, clean)),
        torch.stack(JointLoss()(stages, clean, torch.zeros(7, dtype=torch.long))),
    )


def test_ablation_weights(stages):
    clean = torch.zeros(7, 3)
    clean[:, 2] = 1
    full = JointLoss(alpha=0.5)(stages, clean)
    assert float(JointLoss(alpha=0.0)(stages, clean).total) == pytest.approx(float(full.recovery))
    last_only = JointLoss(alpha=0.0, intermediate_weight=0.0)(stages, clean)
    assert float(last_only.total) == pytest.approx(float(SquaredNormalDistance()(stages[1][0], clean).mean()))


def test_distance_is_the_root_and_its_gradient_is_finite_at_zero():
    normal = torch.tensor([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]], requires_grad=True)
    clean = torch.tensor([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    value = NormalDistance(eps=1e-6)(normal, clean)
    torch.testing.assert_close(value, torch.tensor([0.0, 2.0**0.5]), atol=1e-5, rtol=0)
    value.sum().backward()
    assert normal.grad.isfinite().all()


@pytest.mark.parametrize("distance", [SquaredNormalDistance(), NormalDistance()])
def test_gradcheck(stages, distance):
    batch = torch.tensor([0, 0, 0, 0, 0, 1, 1])
    clean = torch.nn.functional.normalize(torch.arange(21.0, dtype=torch.float64).view(7, 3) - 9.5, dim=-1)
    values = [value.double().requires_grad_() for stage in stages for value in stage]

    def loss(normal, feature, other_normal, other_feature):
        stages = [(normal, feature), (other_normal, other_feature)]
        return tuple(JointLoss(alpha=0.3, intermediate_weight=0.7, distance=distance)(stages, clean, batch))

    assert torch.autograd.gradcheck(loss, values)


@pytest.mark.parametrize(("dtype", "expected"), [(torch.bfloat16, torch.float32), (torch.float64, torch.float64)])
def test_is_computed_in_single_precision_or_better(stages, dtype, expected):
    clean = torch.zeros(7, 3)
    clean[:, 2] = 1
    terms = JointLoss()([(normal.to(dtype), feature.to(dtype)) for normal, feature in stages], clean)
    assert all(term.dtype == expected for term in terms)
