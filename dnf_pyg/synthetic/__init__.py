"""Meshes made in code: clean shapes, and what depth cameras would see of them."""

__all__: list[str] = []
