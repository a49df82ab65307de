import pytest

from dnf_pyg.datamodules import LoaderOptions


def test_defaults_are_those_of_the_paper():
    assert LoaderOptions() == LoaderOptions(batch_size=10, num_workers=0, rotate=True, jitter=0.005)


def test_rejects_batch_size():
    with pytest.raises(ValueError, match=r"Expected 'batch_size' of at least 1 \(got 0\). Raise it."):
        LoaderOptions(batch_size=0)
