"""Weights that load at once."""

import pytest
import torch

from dnf_pyg.nn import DNFNet


@pytest.fixture
def weights(tmp_path):
    torch.manual_seed(0)
    DNFNet(k=(3, 5, 8), residual_k=4, channels=(8, 8, 8), embedding_channels=8).save_pretrained(tmp_path / "net")
    return tmp_path / "net"
