import base64
import json
from functools import cache
from pathlib import Path

import cv2
import numpy as np
import pytest
from pydrake.geometry import SurfaceTriangle, TriangleSurfaceMesh
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import CalcSpatialInertia, SpatialInertia
from riseg_drake.models.household.make_household import make_thing
from riseg_drake.models.household.things import THINGS

from riseg_drake.stations.object_models import parse_body, resolve

MODELS = "package://riseg_drake_models/household"
FOLDER = resolve(MODELS)
NAMES = sorted(path.stem for path in FOLDER.glob("*/*.sdf"))
named = pytest.mark.parametrize(
    "model",
    [pytest.param(name, marks=[] if k % 4 == 0 else pytest.mark.renders) for k, name in enumerate(NAMES)],
    indirect=True,
)
"""Every fourth for the fast tests, the others behind the mark."""


def read_gltf(path: Path) -> tuple[np.ndarray, np.ndarray, dict]:
    """Vertices [n, 3], m, z up, triangles [m, 3] and the material of a glTF file with its data inside."""
    content = json.loads(path.read_text())
    data = base64.b64decode(content["buffers"][0]["uri"].split(",")[1])
    arrays = []
    for accessor, kind in ((content["accessors"][0], "<f4"), (content["accessors"][3], "<u2")):
        view = content["bufferViews"][accessor["bufferView"]]
        part = data[view["byteOffset"] : view["byteOffset"] + view["byteLength"]]
        arrays.append(np.frombuffer(part, kind).reshape(-1, 3))
    x, y, z = arrays[0].astype(float).T
    return np.column_stack([x, -z, y]), arrays[1].astype(int), content["materials"][0]["pbrMetallicRoughness"]


@cache
def inertia_of(path: Path) -> SpatialInertia:
    """As simulated, about the body's origin."""
    return parse_body(MultibodyPlant(0.0), path).default_spatial_inertia()


def height(model) -> float:
    return float(np.ptp(model.X_WB.multiply(model.corners.T)[2]))


def test_there_are_household_things_of_every_kind(models):
    heights = [height(model) for model in models.values()]
    gloss = [read_gltf(model.path.with_suffix(".gltf"))[2] for model in models.values()]
    assert len(models) >= 24
    for kind, least in (("carton", 8), ("can", 4), ("bottle", 4), ("mug", 2), ("bowl", 2)):
        assert sum(name.startswith(kind) for name in models) >= least, kind
    assert sum("lying" in name for name in models) >= 2
    assert sum(0.005 <= each <= 0.009 for each in heights) >= 5
    assert sum("white" in name for name in models) >= 4
    assert sum("black" in name for name in models) >= 4
    assert sum(each["roughnessFactor"] < 0.35 for each in gloss) >= 5
    assert max(heights) < 0.12


def test_the_cartons_for_packing_are_of_one_height(models):
    cartons = ("tea", "oats", "soap", "rice", "biscuits", "muesli", "filters")
    assert {round(height(models[f"carton_{name}"]), 6) for name in cartons} == {0.045}


def test_the_whole_collection_is_light_enough_to_ship():
    assert sum(path.stat().st_size for path in FOLDER.rglob("*.*") if path.suffix != ".pyc") < 4e6


@named
def test_a_thing_stands_with_its_centre_of_mass_well_above_its_footprint(model):
    centre = model.X_WB.multiply(inertia_of(model.path).get_com())
    lowest = model.X_WB.multiply(model.corners.T).T
    lowest = lowest[lowest[:, 2] < model.footprint.bottom + 1e-3][:, :2]
    hull = cv2.convexHull(lowest.astype(np.float32))
    assert cv2.pointPolygonTest(hull, tuple(map(float, centre[:2])), True) > 0.003


@named
def test_mass_properties_are_those_of_the_surface_and_collision_is_as_large(model):
    vertices, faces, _ = read_gltf(model.path.with_suffix(".gltf"))
    inertia = inertia_of(model.path)
    assert inertia.IsPhysicallyValid()
    assert 0.02 < inertia.get_mass() < 0.5
    extent = np.array([vertices.min(axis=0), vertices.max(axis=0)])
    # A round wall is made of straight pieces.
    assert np.abs(np.array([model.corners.min(axis=0), model.corners.max(axis=0)]) - extent).max() < 0.006
    if "mug" not in model.name:  # the handle weighs nothing
        mesh = TriangleSurfaceMesh([SurfaceTriangle(*map(int, face)) for face in faces], list(vertices))
        volume = CalcSpatialInertia(mesh, 1.0).get_mass()
        expected = CalcSpatialInertia(mesh, inertia.get_mass() / volume)
        np.testing.assert_allclose(inertia.get_com(), expected.get_com(), atol=5e-5)
        scale = np.trace(expected.CopyToFullMatrix6()[:3, :3])
        np.testing.assert_allclose(
            inertia.CopyToFullMatrix6()[:3, :3], expected.CopyToFullMatrix6()[:3, :3], atol=2e-3 * scale
        )


@pytest.mark.parametrize("name", ["mug_white", "cup_red", "bowl_blue"])
def test_what_is_hollow_can_hold_something(models, name):
    model = models[name]
    pieces = [
        np.array(
            [[float(x) for x in line.split()[1:]] for line in path.read_text().splitlines() if line[0] == "v"]
        )
        for path in model.path.parent.glob("*_piece_*.obj")
    ]
    middle = height(model) / 2
    for corners in pieces:
        if corners[:, 2].max() > middle:
            assert np.hypot(*corners[:, :2].T).min() > 0.015, "nothing in the middle, above the floor"


@pytest.mark.renders
@pytest.mark.parametrize("thing", THINGS[::6], ids=lambda thing: thing.name)
def test_the_program_makes_the_same_files_again(thing, tmp_path):
    make_thing(thing, tmp_path)
    shipped = {path.name: path for path in (FOLDER / thing.name).iterdir()}
    assert set(shipped) == {path.name for path in tmp_path.iterdir()}
    for path in tmp_path.iterdir():
        if path.suffix == ".png":  # the same picture; its bytes depend on the compressor in OpenCV
            assert np.array_equal(cv2.imread(str(path)), cv2.imread(str(shipped[path.name])))
        else:
            assert path.read_bytes() == shipped[path.name].read_bytes()
