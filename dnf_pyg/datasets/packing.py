"""Neighbour tables on disk: rows of a patch in as few bits as its size needs, 10 instead of 16 for 800 faces."""

import numpy as np
from numba import njit
from numpy.typing import NDArray

__all__ = ["pack_rows", "unpack_rows"]


@njit(cache=True, nogil=True)
def pack_rows(table: NDArray[np.int16], bits: int) -> NDArray[np.uint8]:
    """Pack rows of a patch.

    Args:
        table: Rows from 0, or -1 for none, shape (N, K).
        bits: Bits per entry; ``2 ** bits`` has to be larger than every row plus 1.

    Returns:
        Bytes, shape (ceil(N * K * bits / 8),).
    """
    flat = table.ravel()
    out = np.zeros((len(flat) * bits + 7) // 8, np.uint8)
    for entry in range(len(flat)):
        value = flat[entry] + 1
        for bit in range(bits):
            place = entry * bits + bit
            out[place >> 3] |= ((value >> bit) & 1) << (place & 7)
    return out


@njit(cache=True, nogil=True)
def unpack_rows(packed: NDArray[np.uint8], bits: int, size: int, k: int) -> NDArray[np.int16]:
    """Undo :func:`pack_rows`: give the table of shape (size, k)."""
    out = np.empty(size * k, np.int16)
    mask = (1 << bits) - 1
    held, count, at = 0, 0, 0  # bits read but not used yet
    for entry in range(size * k):
        while count < bits:
            held |= int(packed[at]) << count
            count += 8
            at += 1
        out[entry] = (held & mask) - 1
        held >>= bits
        count -= bits
    return out.reshape(size, k)
