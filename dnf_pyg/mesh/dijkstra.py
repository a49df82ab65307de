"""Compiled searches on the facet graph.

A search keeps the at most ``k`` nearest faces found so far in one sorted array of integers, each of which holds a
distance (upper bits) and a face id (lower ``shift`` bits): comparing two of them compares distance, then face id, and
the array is the result once its last entry is settled. Lengths are integers of at least 1, so sums are exact, ties are
real ties, and every shortest path to one of the ``k`` faces runs through faces that come before it.

``best`` or ``row``, ``stamp`` and ``serial`` are the parts of a :class:`~dnf_pyg.mesh.facet_graph.Scratch`.
"""

import numpy as np
from numba import njit
from numpy.typing import NDArray

__all__ = ["nearest_of_all", "nearest_of_one", "nearest_within"]

Ints = NDArray[np.int64]
Shorts = NDArray[np.int32]


@njit(cache=True, nogil=True)
def _search(
    ptr: Ints, neighbor: Shorts, length: Shorts, source: int, k: int, shift: int, best: Ints, stamp: Shorts,
    serial: int, key: Ints,
) -> int:  # fmt: skip
    """Fill ``key`` with the k faces nearest to ``source``; return how many there are."""
    mask = (1 << shift) - 1
    limit = (1 << (62 - shift)) - 1
    key[0] = source
    best[source] = source
    stamp[source] = serial
    found = 1
    settled = 0
    while settled < found:
        u = key[settled] & mask
        distance = key[settled] >> shift
        for entry in range(ptr[u], ptr[u + 1]):
            v = neighbor[entry]
            new = (min(distance + length[entry], limit) << shift) | v
            if found == k and new >= key[k - 1]:
                continue
            slot = min(found, k - 1)  # where the entry that goes away lies: behind the last, or the last of k
            if stamp[v] == serial:
                if best[v] <= new:
                    continue
                if best[v] <= key[found - 1]:  # not pushed out before
                    slot = np.searchsorted(key[settled + 1 : found], best[v]) + settled + 1
            stamp[v] = serial
            best[v] = new
            if slot == found:
                found += 1
            while key[slot - 1] > new:
                key[slot] = key[slot - 1]
                slot -= 1
            key[slot] = new
        settled += 1
    return found


@njit(cache=True, nogil=True)
def nearest_of_all(
    ptr: Ints, neighbor: Shorts, length: Shorts, k: int, shift: int, first: int, last: int, out: Shorts
) -> None:
    """Write the k nearest faces of each face from ``first`` to ``last`` into ``out``, padded with -1."""
    mask = (1 << shift) - 1
    num_faces = ptr.shape[0] - 1
    best = np.empty(num_faces, np.int64)
    stamp = np.full(num_faces, -1, np.int32)
    key = np.empty(k, np.int64)
    for source in range(first, last):
        found = _search(ptr, neighbor, length, source, k, shift, best, stamp, source, key)
        for column in range(found):
            out[source, column] = key[column] & mask
        out[source, found:] = -1


@njit(cache=True, nogil=True)
def nearest_of_one(
    ptr: Ints, neighbor: Shorts, length: Shorts, source: int, k: int, shift: int, best: Ints, stamp: Shorts, serial: int
) -> Ints:
    """Compute the sorted keys of the k faces nearest to one face."""
    key = np.empty(k, np.int64)
    found = _search(ptr, neighbor, length, source, k, shift, best, stamp, serial, key)
    return key[:found].copy()


@njit(cache=True, nogil=True)
def nearest_within(
    ptr: Ints, neighbor: Shorts, length: Shorts, face_id: Ints, k: int, shift: int, row: Ints, stamp: Shorts,
    serial: int,
) -> NDArray[np.int16]:  # fmt: skip
    """Find the k nearest faces (rows of ``face_id``) of each face, along paths inside ``face_id`` only."""
    size = face_id.shape[0]
    order = np.argsort(face_id)  # local numbers follow face ids, so that ties are broken as in the whole mesh
    for local in range(size):
        row[face_id[order[local]]] = local
        stamp[face_id[order[local]]] = serial
    count = 0
    for local in range(size):
        count += ptr[face_id[local] + 1] - ptr[face_id[local]]
    local_ptr = np.zeros(size + 1, np.int64)
    local_neighbor = np.empty(count, np.int32)
    local_length = np.empty(count, np.int32)
    end = 0
    for local in range(size):
        f = face_id[order[local]]
        for entry in range(ptr[f], ptr[f + 1]):
            if stamp[neighbor[entry]] == serial:
                local_neighbor[end] = row[neighbor[entry]]
                local_length[end] = length[entry]
                end += 1
        local_ptr[local + 1] = end
    best = np.empty(size, np.int64)
    local_stamp = np.full(size, -1, np.int32)
    key = np.empty(k, np.int64)
    mask = (1 << shift) - 1
    out = np.full((size, k), -1, np.int16)
    for local in range(size):
        found = _search(local_ptr, local_neighbor, local_length, local, k, shift, best, local_stamp, local, key)
        for column in range(found):
            out[order[local], column] = order[key[column] & mask]
    return out
