"""The accessor ``mesh.dnf`` of PyVista, which finds it by the entry point ``pyvista.accessors`` of this package.

PyVista imports this module when ``mesh.dnf`` is first used; nothing here imports PyVista.
"""

import sys
from typing import Any

from dnf_pyg.pipeline import denoise

__all__ = ["DNFAccessor"]


class DNFAccessor:
    """Methods of this package on a ``pyvista.PolyData``.

    Args:
        mesh: The mesh.
    """

    def __init__(self, mesh: Any) -> None:
        self._mesh = mesh

    def denoise(self, **options: Any) -> Any:
        """Denoise the mesh, which is not changed.

        Args:
            options: Arguments of :func:`dnf_pyg.denoise`.

        Returns:
            The denoised ``PolyData``.

        Raises:
            MeshError: If it has cells other than triangles.
        """
        return denoise(self._mesh, **options).mesh


if "pyvista" in sys.modules:
    pyvista = sys.modules["pyvista"]
    pyvista.register_dataset_accessor("dnf", pyvista.PolyData)(DNFAccessor)
