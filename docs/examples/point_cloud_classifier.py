"""Tell spheres, boxes, cylinders, cones and tori apart by points on their surfaces.

The layers of dnf_pyg know nothing about meshes: here ``FeatureGroupingConv`` groups the nearest points and
``ChannelAttention`` weighs channels over a whole cloud, in a small classifier that trains in well under a minute.
Run it with ``python docs/examples/point_cloud_classifier.py``.
"""

import math

import torch
from torch import Tensor
from torch.nn import Module
from torch.nn import functional as F
from torch_geometric.data import Data
from torch_geometric.loader import DataLoader
from torch_geometric.nn import MLP, global_max_pool

from dnf_pyg.nn import ChannelAttention, FeatureGroupingConv, feature_neighbors

SHAPES = ("sphere", "box", "cylinder", "cone", "torus")


def sample(shape: str, num_points: int) -> Tensor:
    """Draw points on a shape of random proportions, turned about z, with a little noise."""
    u, v = torch.rand(2, num_points)
    angle = 2 * math.pi * u
    circle = torch.stack([angle.cos(), angle.sin()], dim=1)
    if shape == "sphere":
        pos = F.normalize(torch.randn(num_points, 3), dim=1)
    elif shape == "box":
        pos = 2 * torch.rand(num_points, 3) - 1
        side = torch.arange(num_points) % 6
        pos[torch.arange(num_points), side // 2] = 2.0 * (side % 2) - 1
    elif shape == "cylinder":
        pos = torch.cat([circle, (2 * v - 1).unsqueeze(1)], dim=1)
    elif shape == "cone":
        pos = torch.cat([circle * v.sqrt().unsqueeze(1), (1 - 2 * v.sqrt()).unsqueeze(1)], dim=1)
    else:
        tube = 2 * math.pi * v
        pos = torch.cat([circle * (1 + 0.4 * tube.cos()).unsqueeze(1), 0.4 * tube.sin().unsqueeze(1)], dim=1)
    pos = pos * (0.7 + 0.6 * torch.rand(3))
    turn = 2 * math.pi * torch.rand(())
    rotation = torch.tensor([[turn.cos(), -turn.sin(), 0], [turn.sin(), turn.cos(), 0], [0, 0, 1]])
    return pos @ rotation.t() + 0.02 * torch.randn(num_points, 3)


def clouds(num_per_shape: int, num_points: int = 96) -> list[Data]:
    """Labelled clouds, equally many of each shape."""
    return [
        Data(pos=sample(shape, num_points), y=torch.tensor([label]))
        for label, shape in enumerate(SHAPES)
        for _ in range(num_per_shape)
    ]


class Classifier(Module):
    """Two grouping convolutions, each followed by channel attention; max over the cloud; a head."""

    def __init__(self, num_classes: int, k: int = 12) -> None:
        super().__init__()
        self.k = k
        self.convs = torch.nn.ModuleList([FeatureGroupingConv(3, 32), FeatureGroupingConv(32, 64)])
        self.attentions = torch.nn.ModuleList([ChannelAttention(32), ChannelAttention(64)])
        self.head = MLP([64, 32, num_classes])

    def forward(self, pos: Tensor, batch: Tensor) -> Tensor:
        """Return a logit per class for each cloud."""
        edge_index = feature_neighbors(pos, self.k, batch)
        x = pos
        for conv, attention in zip(self.convs, self.attentions, strict=True):
            x = attention(conv(x, edge_index), batch)
        return self.head(global_max_pool(x, batch))


def accuracy(model: Module, data: list[Data]) -> float:
    """Share of clouds whose shape is found."""
    model.eval()
    with torch.no_grad():
        hits = [
            (model(batch.pos, batch.batch).argmax(dim=1) == batch.y).float()
            for batch in DataLoader(data, batch_size=50)  # type: ignore[arg-type]
        ]
    return float(torch.cat(hits).mean())


def main(num_epochs: int = 8) -> float:
    """Train, and return the accuracy on clouds not trained on."""
    torch.manual_seed(0)
    train, test = clouds(50), clouds(40)
    model = Classifier(len(SHAPES))
    loader = DataLoader(train, batch_size=20, shuffle=True)  # type: ignore[arg-type]
    optimizer = torch.optim.Adam(model.parameters())
    schedule = torch.optim.lr_scheduler.OneCycleLR(optimizer, max_lr=1e-2, total_steps=num_epochs * len(loader))
    for _ in range(num_epochs):
        model.train()
        for batch in loader:
            optimizer.zero_grad()
            F.cross_entropy(model(batch.pos, batch.batch), batch.y).backward()
            optimizer.step()
            schedule.step()
    return accuracy(model, test)


if __name__ == "__main__":
    import sys

    sys.stdout.write(f"accuracy on new clouds: {main():.1%}\n")
