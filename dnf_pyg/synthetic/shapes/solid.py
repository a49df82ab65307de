"""Solids as trees of smooth implicit surfaces joined by union, intersection and complement."""

from collections.abc import Callable, Sequence

import torch
from torch import Tensor

__all__ = ["Field", "Intersection", "Solid", "Surface", "Union"]

Field = Callable[[Tensor], Tensor]


class Solid:
    """A region of space, negative inside, bounded by smooth surfaces that meet in sharp edges.

    ``surfaces`` lists them; the label of a boundary point is the row of its surface in that list.

    Shapes:
        - **evaluate(pos):** :math:`(P, 3)` to values :math:`(P)` and labels :math:`(P)` long
    """

    surfaces: list["Surface"]

    def evaluate(self, pos: Tensor) -> tuple[Tensor, Tensor]:
        """Value of the field at each point and the label of the surface that decides it."""
        raise NotImplementedError

    def normals(self, pos: Tensor, label: Tensor) -> Tensor:
        """Outward unit normals (P, 3) of the labelled surfaces at points (P, 3)."""
        normal = torch.empty_like(pos)
        for surface in label.bincount().nonzero()[:, 0].tolist():
            rows = label == surface
            normal[rows] = self.surfaces[surface].slope(pos[rows])[1]
        return torch.nn.functional.normalize(normal, dim=1)

    def map(self, inverse: Field) -> "Solid":
        """Transform the solid, given the map from the new coordinates to the present ones."""
        return _Mapped(self, inverse)

    def move(self, rotation: Tensor, offset: Tensor | Sequence[float] = (0.0, 0.0, 0.0)) -> "Solid":
        """Turn the solid by a matrix (3, 3), then shift it by ``offset``."""
        shift = torch.as_tensor(offset, dtype=torch.float64)
        return self.map(lambda pos: (pos - shift) @ rotation)

    def __or__(self, other: "Solid") -> "Solid":
        return Union([self, other])

    def __and__(self, other: "Solid") -> "Solid":
        return Intersection([self, other])

    def __sub__(self, other: "Solid") -> "Solid":
        return Intersection([self, ~other])

    def __invert__(self) -> "Solid":
        raise NotImplementedError


class Surface(Solid):
    """A half space bounded by one smooth surface: the leaf of a tree.

    Args:
        field: Continuously differentiable function (P, 3) -> (P), negative inside, slope about 1 near its zero set.

    Example:
        >>> ball = Surface(lambda pos: pos.norm(dim=1) - 1)
        >>> value, gradient = ball.slope(torch.tensor([[2.0, 0, 0]]))
        >>> value.item(), gradient.tolist()
        (1.0, [[1.0, 0.0, 0.0]])
    """

    def __init__(self, field: Field) -> None:
        self.field = field
        self.surfaces = [self]

    def evaluate(self, pos: Tensor) -> tuple[Tensor, Tensor]:
        """Value of the field; every label is 0."""
        return self.field(pos), torch.zeros(pos.size(0), dtype=torch.long)

    def map(self, inverse: Field) -> "Surface":
        """The same surface in other coordinates."""
        return Surface(lambda pos: self.field(inverse(pos)))

    def slope(self, pos: Tensor) -> tuple[Tensor, Tensor]:
        """Value (P) and gradient (P, 3) of the field."""
        with torch.enable_grad():
            pos = pos.detach().requires_grad_()
            value = self.field(pos)
            (gradient,) = torch.autograd.grad(value.sum(), pos)
        return value.detach(), gradient

    def __invert__(self) -> "Surface":
        return Surface(lambda pos: -self.field(pos))


class Union(Solid):
    """Points in at least one of the parts.

    Example:
        >>> low, high = Surface(lambda pos: pos[:, 2]), Surface(lambda pos: 1 - pos[:, 2])
        >>> value, label = Union([low, high]).evaluate(torch.tensor([[0.0, 0, 0.25], [0, 0, 0.75]]))
        >>> value.tolist(), label.tolist()
        ([0.25, 0.25], [0, 1])
    """

    def __init__(self, parts: Sequence[Solid]) -> None:
        self.parts = list(parts)
        self.surfaces = [surface for part in self.parts for surface in part.surfaces]

    def evaluate(self, pos: Tensor) -> tuple[Tensor, Tensor]:
        """Smallest value over the parts, with its label."""
        return self._select(pos, torch.argmin)

    def _select(self, pos: Tensor, choose: Callable[..., Tensor]) -> tuple[Tensor, Tensor]:
        values, labels, count = [], [], 0
        for part in self.parts:
            value, label = part.evaluate(pos)
            values.append(value)
            labels.append(label + count)
            count += len(part.surfaces)
        value, label = torch.stack(values), torch.stack(labels)
        chosen = choose(value, dim=0, keepdim=True)
        return value.gather(0, chosen)[0], label.gather(0, chosen)[0]

    def __invert__(self) -> "Solid":
        return Intersection([~part for part in self.parts])


class Intersection(Union):
    """Points in all the parts.

    Example:
        >>> low, high = Surface(lambda pos: pos[:, 2]), Surface(lambda pos: 1 - pos[:, 2])
        >>> Intersection([low, high]).evaluate(torch.tensor([[0.0, 0, 0.25]]))[0].item()
        0.75
    """

    def evaluate(self, pos: Tensor) -> tuple[Tensor, Tensor]:
        """Largest value over the parts, with its label."""
        return self._select(pos, torch.argmax)

    def __invert__(self) -> "Solid":
        return Union([~part for part in self.parts])


class _Mapped(Solid):
    """A transformed solid, which computes the coordinates once for all of its surfaces."""

    def __init__(self, solid: Solid, inverse: Field) -> None:
        self.solid, self.inverse = solid, inverse
        self.surfaces = [surface.map(inverse) for surface in solid.surfaces]

    def evaluate(self, pos: Tensor) -> tuple[Tensor, Tensor]:
        """Value and label at the points taken back."""
        return self.solid.evaluate(self.inverse(pos))

    def __invert__(self) -> "Solid":
        return _Mapped(~self.solid, self.inverse)
