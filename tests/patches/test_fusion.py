import pytest
import torch

from dnf_pyg.patches import Patch
from dnf_pyg.patches.fusion import PatchFusion, closeness


def patch(face_id, distance):
    return Patch(torch.tensor(face_id), torch.zeros(len(face_id), 1, dtype=torch.int16), torch.tensor(distance))


def test_weights_fall_from_the_seed_to_the_rim():
    torch.testing.assert_close(closeness(torch.tensor([0.0, 3.0, 6.0])), torch.tensor([1.001, 0.501, 0.001]))
    torch.testing.assert_close(closeness(torch.zeros(2)), torch.full((2,), 1.001))  # a patch of one place
    together = closeness(torch.tensor([0.0, 3.0, 6.0, 0.0, 0.0, 2.0]), torch.tensor([0, 0, 0, 1, 2, 2]))
    torch.testing.assert_close(together, torch.tensor([1.001, 0.501, 0.001, 1.001, 1.001, 0.001]))


@pytest.mark.parametrize("together", [True, False])
def test_matches_loop_over_faces(together):
    generator = torch.Generator().manual_seed(0)
    patches = [patch([2, 0, 1], [0.0, 1.0, 2.0]), patch([3, 2], [0.0, 4.0]), patch([2, 3, 0], [0.0, 1.0, 4.0])]
    normals = [torch.nn.functional.normalize(torch.randn(len(p.face_id), 3, generator=generator)) for p in patches]
    fusion = PatchFusion(num_faces=5)
    if together:
        fusion.add(patches, torch.cat(normals))
    else:
        for one, normal in zip(patches, normals, strict=True):
            fusion.add([one], normal)
    fused = fusion.result()
    assert fused.coverage.tolist() == [2, 1, 3, 2, 0]
    for face in range(4):
        total, weights = torch.zeros(3), 0.0
        for one, normal in zip(patches, normals, strict=True):
            for row, other in enumerate(one.face_id.tolist()):
                if other == face:
                    weight = 1.001 - float(one.distance[row] / one.distance.max())
                    total, weights = total + weight * normal[row], weights + weight
        torch.testing.assert_close(fused.normal[face], total / total.norm())
        torch.testing.assert_close(fused.confidence[face], total.norm() / weights)
    assert not fused.normal[4].any()
    assert fused.confidence[4] == 0


def test_confidence_is_one_where_patches_agree():
    fusion = PatchFusion(num_faces=1)
    up = torch.tensor([[0.0, 0.0, 1.0]])
    fusion.add([patch([0], [0.0])], up)
    assert fusion.result().confidence.item() == pytest.approx(1)
    fusion.add([patch([0], [0.0])], -up)
    assert fusion.result().confidence.item() == pytest.approx(0, abs=1e-6)
