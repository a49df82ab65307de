"""Pictures of meshes, the report page and its view in notebooks."""

from dnf_pyg.view.camera import Camera
from dnf_pyg.view.notebook import PageView
from dnf_pyg.view.pictures import draw_faces, draw_meshes, normal_error, save_figure
from dnf_pyg.view.raster import render
from dnf_pyg.view.report import write_index, write_report, write_view

__all__ = [
    "Camera",
    "PageView",
    "draw_faces",
    "draw_meshes",
    "normal_error",
    "render",
    "save_figure",
    "write_index",
    "write_report",
    "write_view",
]
