"""Every source file has its test file at the same place, or is named here beside the file that tests it."""

from pathlib import Path

import pytest

TESTS = Path(__file__).parent
ROOT = TESTS.parent
SOURCES = sorted(
    path.relative_to(ROOT)
    for top in ("dnf_pyg", "datamodules")
    for path in (ROOT / top).rglob("*.py")
    if path.name != "__init__.py"
)
ELSEWHERE = {  # parts that only show in what is made of them
    "datamodules/test_broken.py": ["datamodules/clean_meshes.py"],
    "commands/test_predict.py": ["datamodules/mesh_files.py", "dnf_pyg/train/prediction.py"],
    "commands/test_train.py": ["dnf_pyg/commands/run_folder.py"],
    "test_bad_input.py": ["dnf_pyg/errors.py"],
    "test_cli.py": [f"dnf_pyg/commands/{name}.py" for name in ("add_noise", "compare", "configs")]
    + ["dnf_pyg/__main__.py"],
    "test_cli_denoise.py": [f"dnf_pyg/commands/{name}.py" for name in ("denoise", "outcome", "showing")],
    "commands/test_parser.py": [f"dnf_pyg/commands/{name}.py" for name in ("options", "shape_options", "view_options")],
    "commands/test_benchmark.py": ["dnf_pyg/commands/evaluation_options.py", "dnf_pyg/commands/methods.py"],
    "commands/test_weights.py": ["dnf_pyg/commands/export_weights.py"],
    "commands/test_experiment.py": [
        f"dnf_pyg/evaluate/experiments/{name}.py" for name in ("ablation", "series_report")
    ],
    "evaluate/test_metrics.py": ["dnf_pyg/evaluate/measures.py"],
    "evaluate/baselines/test_bilateral.py": ["dnf_pyg/evaluate/baselines/filtered.py"],
    "view/test_report.py": ["dnf_pyg/view/page.py"],
    "patches/test_seeds.py": ["dnf_pyg/patches/coverage.py"],
    "datasets/test_datasets.py": [
        f"dnf_pyg/datasets/{name}.py" for name in ("fresh_patch_dataset", "mesh_dataset", "patch_dataset")
    ],
    "io/test_inputs.py": ["dnf_pyg/io/arrays.py", "dnf_pyg/io/foreign.py"],
    "io/test_files.py": ["dnf_pyg/io/convert.py"],
    "mesh/test_geodesic.py": ["dnf_pyg/mesh/dijkstra.py", "dnf_pyg/mesh/facet_graph.py"],
    "io/formats/test_obj.py": ["dnf_pyg/io/formats/document.py"],
    "io/formats/test_gltf.py": [f"dnf_pyg/io/formats/{name}.py" for name in ("glb", "gltf_nodes", "gltf_scene")],
    "io/formats/test_ply.py": [f"dnf_pyg/io/formats/{name}.py" for name in ("ply_body", "ply_header")],
    "synthetic/shapes/test_topology.py": ["dnf_pyg/synthetic/shapes/incidence.py"],
    "synthetic/test_shapes.py": [
        f"dnf_pyg/synthetic/shapes/{name}.py"
        for name in ("build", "cad", "contour", "displaced", "organic", "placing", "remesh", "sculpted")
    ],
}
TESTED_BY = {source: test for test, sources in ELSEWHERE.items() for source in sources}


def mirror(source):
    """Where the tests of a source file belong."""
    inside = source.relative_to("dnf_pyg") if source.parts[0] == "dnf_pyg" else source
    return inside.with_name(f"test_{source.name}")


@pytest.mark.parametrize("source", SOURCES, ids=str)
def test_has_its_tests(source):
    own = mirror(source)
    assert (TESTS / TESTED_BY.get(str(source), own)).is_file(), f"write tests/{own}"
    assert str(source) not in TESTED_BY or not (TESTS / own).is_file(), f"tests/{own} is there: no need to name another"


def test_nothing_is_named_that_is_gone():
    assert set(TESTED_BY) <= {str(source) for source in SOURCES}
