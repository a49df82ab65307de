"""Meshes of other libraries; classes that stand in for PyVista, Open3D and meshio have the members that are used."""

import copy

import numpy as np
import pytest
import torch
import trimesh
from torch_geometric.data import Data

from dnf_pyg.errors import MeshError, MeshFileError, OptionError
from dnf_pyg.io import MeshFile, read_mesh
from dnf_pyg.io.inputs import as_input, as_mask, save_mesh

BOX = trimesh.creation.box()
MOVE = torch.tensor([0.5, 0.0, 0.0], dtype=torch.float64)


class PolyData:
    """As in PyVista: float32 points, faces with the number of corners before each."""

    def __init__(self, points, faces):
        self.points, self.faces = points, faces

    def copy(self):
        return copy.deepcopy(self)


class Vector3dVector:
    """As in Open3D: made from an array, read as one."""

    def __init__(self, rows):
        self.rows = np.array(rows, dtype=np.float64)

    def __array__(self, dtype=None, copy=None):
        return self.rows


class TriangleMesh:
    def __init__(self, vertices, triangles):
        self.vertices, self.triangles = Vector3dVector(vertices), triangles
        self.normals_of = None

    def has_vertex_normals(self):
        return self.normals_of is not None

    def compute_vertex_normals(self):
        self.normals_of = self.vertices


class CellBlock:
    def __init__(self, kind, data):
        self.type, self.data = kind, data


class Mesh:
    def __init__(self, points, cells):
        self.points, self.cells = points, cells


PolyData.__module__ = "pyvista.core.pointset"
TriangleMesh.__module__ = "open3d.cpu.pybind.geometry"
Mesh.__module__ = "meshio._mesh"


def polydata(mesh=BOX):
    return PolyData(mesh.vertices.astype(np.float32), np.insert(mesh.faces, 0, 3, axis=1).ravel())


def check(mesh, positions, *, places=BOX.vertices):
    """Read a box, move it, and find the positions of the result; the given mesh must not change."""
    read = as_input(mesh)
    assert (read.pos.dtype, read.face.dtype) == (torch.float64, torch.long)
    torch.testing.assert_close(read.pos, torch.tensor(places), rtol=0, atol=1e-6)
    assert torch.equal(read.face, torch.tensor(BOX.faces).t())
    before = np.array(positions(mesh))
    result = read.with_positions(read.pos + MOVE)
    assert type(result) is type(mesh)
    np.testing.assert_allclose(np.array(positions(result)), before + MOVE.numpy(), atol=1e-6)
    np.testing.assert_array_equal(np.array(positions(mesh)), before)
    return result


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_arrays(dtype):
    vertices, faces = BOX.vertices.astype(dtype), BOX.faces.astype(np.int32)
    moved = check((vertices, faces), lambda mesh: mesh[0])
    assert moved[0].dtype == dtype
    assert moved[1] is faces
    check([vertices[::-1][::-1], faces[:, ::-1][:, ::-1]], lambda mesh: mesh[0])
    turned = as_input((vertices, faces[:, ::-1]))  # negative strides
    assert torch.equal(turned.face, torch.tensor(BOX.faces[:, ::-1].copy()).t())


def test_tensors_and_whole_numbers():
    moved = check((torch.tensor(BOX.vertices).float(), torch.tensor(BOX.faces)), lambda mesh: mesh[0])
    assert moved[0].dtype == torch.float32
    whole = as_input((np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]]), np.array([[0, 1, 2]])))
    assert whole.with_positions(whole.pos + MOVE)[0][0, 0] == 0.5


def test_data_of_pyg():
    data = Data(pos=torch.tensor(BOX.vertices).float(), face=torch.tensor(BOX.faces).t(), name="box", y=torch.ones(1))
    moved = check(data, lambda mesh: mesh.pos)
    assert (moved.pos.dtype, moved.name) == (torch.float32, "box")
    with pytest.raises(MeshError, match="PyG Data with 'pos' and 'face'"):
        as_input(Data(pos=data.pos))


def test_file_and_path(tmp_path):
    BOX.export(tmp_path / "box.ply")
    file = read_mesh(tmp_path / "box.ply")
    check(file, lambda mesh: mesh.pos)
    for path in (tmp_path / "box.ply", str(tmp_path / "box.ply")):
        read = as_input(path)
        moved = read.with_positions(read.pos + MOVE)
        assert isinstance(moved, MeshFile)
        save_mesh(moved, moved.pos, moved.face, tmp_path / "moved.ply")
        torch.testing.assert_close(read_mesh(tmp_path / "moved.ply").pos, file.pos + MOVE, rtol=0, atol=1e-6)


def test_trimesh_keeps_its_colours():
    box = BOX.copy()
    box.visual.face_colors = np.arange(48).reshape(12, 4)
    moved = check(box, lambda mesh: mesh.vertices)
    assert (moved.visual.face_colors == box.visual.face_colors).all()


def test_scene_of_one_mesh_and_of_several(tmp_path):
    check(trimesh.Scene(BOX), lambda scene: next(iter(scene.geometry.values())).vertices)
    scene = trimesh.Scene()
    turn = trimesh.transformations.rotation_matrix(1.0, (1, 2, 3), (4, 5, 6))
    scene.add_geometry(BOX, geom_name="turned", transform=turn)
    scene.add_geometry(trimesh.creation.icosphere(subdivisions=1), geom_name="ball")
    scene.add_geometry(trimesh.load_path([[0, 0, 0], [1, 1, 1]]), geom_name="line")
    read = as_input(scene)
    assert read.face.size(1) == 12 + 80
    np.testing.assert_allclose(read.pos[:8], trimesh.transform_points(BOX.vertices, turn))
    pos = read.pos.clone()
    pos[:8] += MOVE
    result = read.with_positions(pos)
    assert list(result.geometry) == ["turned", "ball", "line"]
    np.testing.assert_allclose(
        trimesh.transform_points(result.geometry["turned"].vertices, turn), read.pos[:8] + MOVE, atol=1e-12
    )
    assert (result.geometry["ball"].vertices == scene.geometry["ball"].vertices).all()
    assert (scene.geometry["turned"].vertices == BOX.vertices).all()
    save_mesh(result, pos, read.face, tmp_path / "scene.glb")
    assert set(trimesh.load_scene(tmp_path / "scene.glb").geometry) >= {"turned", "ball"}


def test_class_derived_from_one_of_a_library():
    class Part(trimesh.Trimesh):
        pass

    class Surface(PolyData):
        pass

    part = as_input(Part(BOX.vertices, BOX.faces, process=False))
    assert torch.equal(part.face, torch.tensor(BOX.faces).t())
    np.testing.assert_allclose(part.with_positions(part.pos + MOVE).vertices, BOX.vertices + MOVE.numpy(), atol=1e-6)
    check(Surface(BOX.vertices, polydata().faces), lambda mesh: mesh.points)
    with pytest.raises(MeshError, match=r"trimesh.Scene \(got PointCloud\). Mesh it first"):
        as_input(trimesh.PointCloud(BOX.vertices))


def test_pyvista():
    moved = check(polydata(), lambda mesh: mesh.points)
    assert moved.points.dtype == np.float32
    for faces in (np.array([4, 0, 1, 2, 3]), np.array([], dtype=int)):
        with pytest.raises(MeshError, match=r"PolyData of triangles.*Call mesh.triangulate\(\)"):
            as_input(PolyData(BOX.vertices, faces))


def test_open3d():
    mesh = TriangleMesh(BOX.vertices, BOX.faces)
    moved = check(mesh, lambda mesh: mesh.vertices.rows)
    assert not moved.has_vertex_normals()
    mesh.compute_vertex_normals()
    moved = check(mesh, lambda mesh: mesh.vertices.rows)
    assert moved.normals_of is moved.vertices  # computed again
    del mesh.triangles
    with pytest.raises(MeshError, match=r"TriangleMesh \(got TriangleMesh\). Call mesh.to_legacy\(\)"):
        as_input(mesh)


def test_meshio():
    blocks = [CellBlock("triangle", BOX.faces[:5]), CellBlock("line", [[0, 1]]), CellBlock("triangle", BOX.faces[5:])]
    check(Mesh(BOX.vertices, blocks), lambda mesh: mesh.points)
    with pytest.raises(MeshError, match=r"triangles \(got cells \['quad', 'triangle'\]\). Triangulate it first"):
        as_input(Mesh(BOX.vertices, [*blocks, CellBlock("quad", [[0, 1, 2, 3]])]))


def test_save_writes_the_triangles_of_any_kind(tmp_path):
    read = as_input(polydata())
    save_mesh(polydata(), read.pos, read.face, tmp_path / "box.obj")
    assert torch.equal(read_mesh(tmp_path / "box.obj").face, read.face)
    with pytest.raises(MeshFileError, match=r"ending in .*\(got .*box.docx"):
        save_mesh(polydata(), read.pos, read.face, tmp_path / "box.docx")


@pytest.mark.parametrize(
    ("mesh", "text"),
    [
        (3, r"'mesh' to be a path, .*\(got int\). Convert it"),
        (([[0, 0]], [[0, 1, 2]]), r"'vertices' of shape \[number, 3\] \(got \[1, 2\]\). Give x, y, z of each"),
        (([[0, 0, 0]] * 4, [[0, 1], [1, 2], [2, 3]]), r"\(got \[3, 2\]\). Triangulate or transpose it"),
        (
            ([[0, 0, 0]] * 4, [[0, 1, 2, 3]]),
            r"'faces' of shape \[number, 3\] \(got \[1, 4\]\). Triangulate or transpose it",
        ),
        (([[0, 0, 0]] * 3, [[0.0, 1.0, 2.0]]), r"'faces' to be whole numbers \(got float64\)"),
    ],
)
def test_rejects_what_is_no_mesh(mesh, text):
    with pytest.raises(MeshError, match=text):
        as_input(mesh)


def test_missing_file(tmp_path):
    with pytest.raises(MeshFileError, match=r"absent.obj', which does not exist"):
        as_input(tmp_path / "absent.obj")


def test_mask():
    assert as_mask(None, 2).tolist() == [True, True]
    for mask in (np.array([True, False])[::-1], torch.tensor([False, True])):
        assert as_mask(mask, 2).tolist() == [False, True]
    for wrong in (np.array([1, 0]), torch.ones(3, dtype=torch.bool)):
        with pytest.raises(OptionError, match=r"'mask' of shape \[2\] and type bool \(got \[[23]\]"):
            as_mask(wrong, 2)
