import torch

from dnf_pyg.nn.frame import in_frame, out_of_frame, patch_frames


def rotation(mirror=False):
    q = torch.linalg.qr(torch.randn(3, 3)).Q
    return q if (torch.linalg.det(q) < 0) == mirror else -q


def test_axes_turn_with_the_patch():
    normal = torch.nn.functional.normalize(torch.randn(50, 3), dim=1)
    frame = patch_frames(normal)
    torch.testing.assert_close(frame[0].t() @ frame[0], torch.eye(3))
    for mirror in (False, True):
        turn = rotation(mirror)
        torch.testing.assert_close(patch_frames(normal @ turn.t())[0], turn @ frame[0])


def test_batch_equals_each_patch_alone():
    normal = torch.nn.functional.normalize(torch.randn(30, 3), dim=1)
    batch = torch.tensor([0] * 10 + [1] * 20)
    alone = torch.cat([patch_frames(normal[:10]), patch_frames(normal[10:])])
    torch.testing.assert_close(patch_frames(normal, batch), alone)
    torch.testing.assert_close(patch_frames(normal, batch, batch_size=2), alone)


def test_flat_patch_is_finite():
    frame = patch_frames(torch.tensor([[0.0, 0.0, 1.0]]).expand(5, 3))[0]
    torch.testing.assert_close(frame.t() @ frame, torch.eye(3))
    torch.testing.assert_close(frame[:, 2], torch.tensor([0.0, 0.0, 1.0]))  # largest eigenvalue, positive side


def test_vectors_in_a_frame_are_their_shares_along_its_axes():
    vector, frame = torch.randn(6, 3), torch.linalg.qr(torch.randn(6, 3, 3)).Q
    out = in_frame(vector, frame)
    for i in range(6):
        for axis in range(3):
            torch.testing.assert_close(out[i, axis], vector[i] @ frame[i, :, axis])
    torch.testing.assert_close(in_frame(vector, frame[:1]), vector @ frame[0])
    torch.testing.assert_close(out_of_frame(in_frame(vector, frame), frame), vector)
