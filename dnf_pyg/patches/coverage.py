"""Seeds whose patches cover a mesh: a set cover over many candidate patches, improved by local search."""

from typing import NamedTuple

import numpy as np
import torch
from numba import njit
from numpy.typing import NDArray
from torch import Generator, Tensor

from dnf_pyg.mesh import FacetGraph
from dnf_pyg.mesh.geodesic import BoundDijkstra

__all__ = ["plan_seeds"]

_CANDIDATES = 16  # candidate patches that contain a face, on average
_STEPS = 10  # exchanges of the search per patch of a cover without overlap; more exchanges take longer than the network
# takes for the patches that they save

Ints = NDArray[np.int64]
Shorts = NDArray[np.int32]
Flags = NDArray[np.bool_]
Whole = int | np.int64


def plan_seeds(graph: FacetGraph, patch_size: int, min_coverage: int, generator: Generator | None) -> Tensor:
    """Choose few seeds such that every face lies in at least ``min_coverage`` of their patches.

    The candidates are the patches of many random faces. A cover is picked from them greedily and then improved:
    whenever it is complete, one patch is removed, and patches are exchanged until it is complete again; faces that
    stay uncovered gain weight.

    Source: row weighting local search; Gao, Weise and Li, "An efficient local search heuristic with row weighting
    for the unicost set covering problem", European Journal of Operational Research 246 (2015).

    Args:
        graph: Facet graph of the mesh; patches grow by Dijkstra's search.
        patch_size: Faces per patch N.
        min_coverage: Patches that every face must lie in.
        generator: Source of randomness.

    Returns:
        Seeds, shape (P,) long; a component that is no larger than a patch gets ``min_coverage`` of them.
    """
    growth = BoundDijkstra(graph)
    num_faces = graph.num_faces
    order = torch.randperm(num_faces, generator=generator, device="cpu").numpy()
    held = np.zeros(num_faces, np.int32)
    missing = np.full(num_faces, min_coverage, np.int32)
    seeds: list[int] = []
    pool: list[Shorts] = []
    chosen: list[int] = []
    ideal = -(-min_coverage * num_faces // patch_size)  # patches of a cover without any overlap
    for turn in range(1 + min_coverage):  # random seeds, then faces that too few candidates contain
        waiting = order[: _CANDIDATES * num_faces // patch_size + 1] if turn == 0 else order[held[order] < turn]
        for seed in waiting.tolist():
            if (turn and held[seed] >= turn) or not missing[seed]:
                continue
            patch = growth.grow(seed, patch_size + 1)[0].numpy().astype(np.int32)
            if len(patch) > patch_size:  # the component is larger than a patch
                seeds.append(seed)
                pool.append(patch[:patch_size])
                held[pool[-1]] += 1
            else:
                chosen += np.resize(patch, min_coverage).tolist()
                held[patch] = min_coverage
                missing[patch] = 0
    if pool:
        steps = _STEPS * ideal
        picked = _search_cover(np.concatenate(pool), patch_size, missing, steps)
        chosen += np.array(seeds)[picked].tolist()
    return torch.from_numpy(np.array(chosen, np.int64))


class _Cover(NamedTuple):
    """State of a search; the faces of candidate c are ``member[c * size:(c + 1) * size]``."""

    member: Shorts
    size: int
    ptr: Ints  # candidates of face f: owner[ptr[f]:ptr[f + 1]]
    owner: Shorts
    missing: Shorts  # patches that a face still lacks; negative if it lies in more than it needs
    weight: Ints  # of a face; grows while the face is incomplete
    score: Ints  # weight of the faces that a candidate completes, or would leave incomplete if it is picked
    picked: Flags
    inside: Ints  # the first left[1] entries are the picked candidates
    rank: Ints  # place of a candidate in inside
    changed: Ints  # step in which a candidate was last exchanged; the oldest wins a tie
    todo: Ints  # the first left[0] entries are the incomplete faces
    place: Ints  # place of a face in todo
    left: Ints


@njit(cache=True, nogil=True)
def _search_cover(member: Shorts, size: int, missing: Shorts, steps: int) -> Flags:
    """Pick candidates so that no face is left incomplete; ``missing`` counts down."""
    num_faces, count = len(missing), len(member) // size
    ptr = np.zeros(num_faces + 1, np.int64)
    for entry in range(len(member)):
        ptr[member[entry] + 1] += 1
    for f in range(num_faces):
        ptr[f + 1] += ptr[f]
    owner = np.empty(len(member), np.int32)
    end = ptr[:-1].copy()
    for entry in range(len(member)):
        owner[end[member[entry]]] = entry // size
        end[member[entry]] += 1
    todo, place = np.empty(num_faces, np.int64), np.empty(num_faces, np.int64)
    left = np.zeros(2, np.int64)
    for f in range(num_faces):
        if missing[f] > 0:
            todo[left[0]] = f
            place[f] = left[0]
            left[0] += 1
    weight, score = np.ones(num_faces, np.int64), np.full(count, size, np.int64)
    picked, changed = np.zeros(count, np.bool_), np.zeros(count, np.int64)
    inside, rank = np.zeros(count, np.int64), np.zeros(count, np.int64)
    cover = _Cover(member, size, ptr, owner, missing, weight, score, picked, inside, rank, changed, todo, place, left)
    start, nobody = np.int64(0), np.int64(-1)  # typed: literals would compile the functions once more
    while left[0] > 0:
        found: Whole = start
        for c in range(count):
            if not picked[c] and (picked[found] or score[c] > score[found]):
                found = c
        _exchange(cover, found, start)
    best = picked.copy()
    random = np.uint64(1)
    for step in range(1, steps + 1):
        while left[0] == 0:
            best[:] = picked
            _exchange(cover, _cheapest(cover, nobody), step)
        latest = _cheapest(cover, step - 1)
        if latest < 0:
            break
        _exchange(cover, latest, step)
        random = random * np.uint64(6364136223846793005) + np.uint64(1442695040888963407)
        f = todo[np.int64(random >> np.uint64(33)) % left[0]]
        found = -1
        for entry in range(ptr[f], ptr[f + 1]):
            c = owner[entry]
            if not picked[c] and c != latest and (found < 0 or _better(score[c], score[found], changed, c, found)):
                found = c
        _exchange(cover, latest if found < 0 else found, step)
        for at in range(left[0]):
            weight[todo[at]] += 1
            for entry in range(ptr[todo[at]], ptr[todo[at] + 1]):
                score[owner[entry]] += 1
    return best


@njit(cache=True, nogil=True)
def _better(score: Whole, other: Whole, changed: Ints, c: Whole, d: Whole) -> bool | np.bool_:
    return score > other or (score == other and changed[c] < changed[d])


@njit(cache=True, nogil=True)
def _cheapest(cover: _Cover, tabu: Whole) -> Whole:
    """Find the picked candidate that costs least to remove, except those that were added in step ``tabu``."""
    found = -1
    for at in range(cover.left[1]):
        c = cover.inside[at]
        free = cover.changed[c] != tabu or tabu < 1
        if free and (found < 0 or _better(-cover.score[c], -cover.score[found], cover.changed, c, found)):
            found = c
    return found


@njit(cache=True, nogil=True)
def _exchange(cover: _Cover, c: Whole, step: Whole) -> None:
    """Add or remove a candidate, and update counts and scores."""
    member, size, ptr, owner, missing, weight, score, picked, inside, rank, changed, todo, place, left = cover
    put = not picked[c]
    if put:
        inside[left[1]] = c
        rank[c] = left[1]
        left[1] += 1
    else:
        left[1] -= 1
        moved = inside[left[1]]
        inside[rank[c]] = moved
        rank[moved] = rank[c]
    picked[c] = put
    changed[c] = step
    total = 0
    for at in range(c * size, (c + 1) * size):
        f = member[at]
        before = missing[f]
        missing[f] = before - 1 if put else before + 1
        low, high = min(before, missing[f]), max(before, missing[f])
        sign = -1 if put else 1
        if low == 0:  # between complete and incomplete: the scores of the other candidates change
            if put:
                left[0] -= 1
                last = todo[left[0]]
                todo[place[f]] = last
                place[last] = place[f]
            else:
                todo[left[0]] = f
                place[f] = left[0]
                left[0] += 1
            for entry in range(ptr[f], ptr[f + 1]):
                if not picked[owner[entry]]:
                    score[owner[entry]] += sign * weight[f]
        elif high == 0:  # between just complete and more: the scores of the picked candidates change
            for entry in range(ptr[f], ptr[f + 1]):
                if picked[owner[entry]]:
                    score[owner[entry]] += sign * weight[f]
        if low >= 0 if put else high > 0:
            total += weight[f]
    score[c] = total
