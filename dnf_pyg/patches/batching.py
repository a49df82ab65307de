"""Batches of patches for calls of a network."""

from collections.abc import Iterable, Iterator

from torch_geometric.data import Data

from dnf_pyg.patches.patch import FaceFeatures, Patch, patches_to_data

__all__ = ["batches"]


def batches(patches: Iterable[Patch], features: FaceFeatures, max_faces: int) -> Iterator[tuple[list[Patch], Data]]:
    """Batch patches by their faces, so that thousands of small components share one call of the network.

    Args:
        patches: Patches of one mesh.
        features: Features of all faces of the mesh.
        max_faces: Largest number of faces per batch; a patch with more is a batch of its own.

    Yields:
        The patches of a batch, in the order given, and their :func:`~dnf_pyg.patches.patch.patches_to_data`.

    Example:
        >>> import torch
        >>> from dnf_pyg.patches import PatchExtractor
        >>> pos, face = torch.eye(3).repeat(5, 1), torch.arange(15).view(5, 3).t()  # five triangles on their own
        >>> extractor = PatchExtractor(pos, face)
        >>> found = batches(map(extractor.extract, range(5)), FaceFeatures.from_mesh(pos, face), max_faces=2)
        >>> [data.batch.tolist() for _, data in found]
        [[0, 1], [0, 1], [0]]
    """
    group: list[Patch] = []
    num_faces = 0
    for patch in patches:
        size = patch.face_id.size(0)
        if group and num_faces + size > max_faces:
            yield group, patches_to_data(group, features)
            group, num_faces = [], 0
        group.append(patch)
        num_faces += size
    if group:
        yield group, patches_to_data(group, features)
