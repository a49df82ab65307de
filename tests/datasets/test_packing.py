import numpy as np
import pytest

from dnf_pyg.datasets.packing import pack_rows, unpack_rows


@pytest.mark.parametrize(("size", "k"), [(1, 1), (7, 3), (800, 50), (1023, 2), (32767, 1)])
def test_round_trip(size, k):
    table = np.random.default_rng(0).integers(-1, size, (size, k)).astype(np.int16)
    table[0, 0], table[-1, -1] = -1, size - 1
    bits = size.bit_length()
    packed = pack_rows(table, bits)
    assert len(packed) == -(-size * k * bits // 8)
    assert np.array_equal(unpack_rows(packed, bits, size, k), table)


def test_bits_by_hand():
    assert pack_rows(np.array([[0, -1, 2]], np.int16), 2).tolist() == [0b110001]
