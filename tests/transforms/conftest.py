import pytest
import torch
from torch_geometric.data import Data


@pytest.fixture
def data():
    normal = torch.nn.functional.normalize(torch.randn(500, 3, generator=torch.Generator().manual_seed(0)), dim=1)
    return Data(x=normal, y=normal.flip(0), face_id=torch.arange(500))
