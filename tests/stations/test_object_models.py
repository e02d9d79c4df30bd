import warnings

import numpy as np
import pytest
import trimesh

from riseg_drake.host.terminal import Notice
from riseg_drake.stations.object_models import SceneError, find_model, find_models, with_remedy

CUBE = "\n".join(
    [
        *(f"v {x} {y} {z}" for z in (0, 0.04) for y in (-0.03, 0.03) for x in (-0.02, 0.02)),
        *("f 1 3 4 2", "f 5 6 8 7", "f 1 2 6 5", "f 3 7 8 4", "f 1 5 7 3", "f 2 4 8 6"),
    ]
)


def thing(folder, url):
    """A model as Gazebo has it: a folder of its name, with meshes in a folder of their own."""
    (folder / "thing" / "meshes").mkdir(parents=True)
    (folder / "thing" / "meshes" / "cube.obj").write_text(CUBE)
    mesh = f"<geometry><mesh><uri>{url}</uri></mesh></geometry>"
    (folder / "thing" / "model.sdf").write_text(
        "<sdf version='1.6'><model name='thing'><link name='link'><inertial><mass>0.2</mass></inertial>"
        f"<visual name='v'>{mesh}</visual><collision name='c'>{mesh}</collision></link></model></sdf>"
    )
    return str(folder)


@pytest.mark.parametrize(
    "url", ["meshes/cube.obj", "model://thing/meshes/cube.obj", "package://thing/meshes/cube.obj"]
)
def test_meshes_are_found_beside_the_file_however_they_are_named(tmp_path, url):
    (model,) = find_models(thing(tmp_path, url))
    size = model.corners.max(0) - model.corners.min(0)
    assert size == pytest.approx([0.04, 0.06, 0.04], abs=1e-6)


def test_meshes_of_a_package_that_is_beside_the_model(tmp_path):
    folder = thing(tmp_path, "model://parts/cube.obj")
    (tmp_path / "parts").mkdir()
    (tmp_path / "parts" / "cube.obj").write_text(CUBE)
    (model,) = find_models(folder)
    assert model.name == "thing"


def test_a_package_that_is_nowhere_is_named(tmp_path):
    with pytest.raises(SceneError, match="unknown package 'elsewhere'"):
        find_models(thing(tmp_path, "package://elsewhere/cube.obj"))


BOX = "<box><size>.08 .06 .05</size></box>"


def boxed(folder, inertial, scale="1 1 1", mesh=None):
    """A box, or a mesh of a cube."""
    folder.mkdir()
    shape = BOX if mesh is None else f"<mesh><uri>cube.obj</uri><scale>{scale}</scale></mesh>"
    if mesh is not None:
        (folder / "cube.obj").write_text(mesh)
    (folder / "thing.sdf").write_text(
        f"<sdf version='1.6'><model name='thing'><link name='link'><inertial>{inertial}</inertial>"
        f"<visual name='v'><geometry>{shape}</geometry></visual>"
        f"<collision name='c'><geometry>{shape}</geometry></collision></link></model></sdf>"
    )
    return str(folder)


INERTIA = "<mass>{m}</mass><inertia><ixx>{i}</ixx><iyy>{i}</iyy><izz>{i}</izz></inertia>"


@pytest.mark.parametrize(
    ("inertial", "mesh", "said"),
    [
        (
            "<mass>0.2</mass>",
            CUBE.replace("0.0", "1"),
            "m long; .* a scale of 0.001 0.001 0.001",
        ),
        ("<mass>0.2</mass>", CUBE.replace("0.0", "0.0000"), "6e-05 m long"),
        (INERTIA.format(m=200, i=0.1), None, "has mass 200; .* is it in grams"),
        (
            "<mass>0.2</mass><inertia><ixx>1.3</ixx><iyy>1e-4</iyy><izz>1e-4</izz></inertia>",
            None,
            "invalid inertia.*moments are kg m.2 .* each less than the sum of the other two",
        ),
        (INERTIA.format(m=0.2, i=0.1), None, "moment of inertia of 0.1 kg m.2; .* it is 0.00063 at most"),
    ],
)
def test_what_is_no_thing_of_a_table_is_told_by_its_unit(tmp_path, inertial, mesh, said):
    """A diagonal of 11.2 cm and 0.2 kg: 0.2 * 0.056^2 = 0.00063 at most."""
    with pytest.raises(SceneError, match=said):
        find_models(boxed(tmp_path / "models", inertial, mesh=mesh))


def test_millimetres_that_are_said_to_be_some_and_a_plain_box_are_things_of_a_table(tmp_path):
    (model,) = find_models(boxed(tmp_path / "a", "<mass>0.2</mass>", ".001 .001 .001", CUBE.replace("0.0", "")))
    assert model.corners.max(0) - model.corners.min(0) == pytest.approx([0.004, 0.006, 0.004], abs=1e-6)
    (model,) = find_models(boxed(tmp_path / "b", INERTIA.format(m=0.2, i=2e-4)))
    assert model.name == "thing"


def test_a_mesh_without_normals_is_told_with_the_remedy():
    said = with_remedy("OBJ has no normals:\n cube.obj")
    assert said == (
        "OBJ has no normals: cube.obj; its surface needs them: "
        "trimesh.load(FILE, process=False).export(FILE, include_normals=True)"
    )


def test_the_remedy_for_a_mesh_without_normals_gives_it_some(tmp_path):
    file = tmp_path / "cube.obj"
    file.write_text(CUBE)
    trimesh.load(file, process=False).export(file, include_normals=True)
    assert len([line for line in file.read_text().splitlines() if line.startswith("vn ")]) >= 8


SEEN = "<visual name='v'><geometry><box><size>0.04 0.06 0.02</size></box></geometry></visual>"


def box_model(folder, name="brick", inertial="<mass>0.2</mass>", shape="", pose="", more="", sees=None):
    shape = shape or "<box><size>0.04 0.06 0.02</size></box>"
    body = f"<geometry>{shape}</geometry>"
    seen = f"<visual name='v'>{body}</visual>" if sees is None else sees
    path = folder / f"{name}.sdf"
    path.write_text(
        f"<sdf version='1.6'><model name='{name}'>{more}<link name='link'><inertial>{inertial}</inertial>"
        f"{seen}<collision name='c'>{pose}{body}</collision></link></model></sdf>"
    )
    return path


def test_a_box_is_measured_as_it_is_drawn(tmp_path):
    pose = "<pose>0.01 0 0.03 0 0 0</pose>"
    model = find_model(
        str(box_model(tmp_path, inertial="<mass>0.2</mass><pose>0.01 0 0.03 0 0 0</pose>", pose=pose))
    )
    assert model.name == "brick"
    assert model.corners.min(0) == pytest.approx([-0.01, -0.03, 0.02])
    assert model.corners.max(0) == pytest.approx([0.03, 0.03, 0.04])
    assert model.footprint.bottom == pytest.approx(0.02)
    assert model.centre == pytest.approx([0.01, 0, 0.03])
    assert model.axes.shape == (0, 3)
    assert model.over_areas
    assert model.X_WB.IsExactlyIdentity()


def test_of_many_pieces_only_the_outermost_points_are_kept(tmp_path):
    # A smaller box amid the other has no corner of the hull.
    inner = "<collision name='inner'><geometry><box><size>0.01 0.02 0.02</size></box></geometry></collision>"
    corners = find_model(str(box_model(tmp_path, sees=f"{SEEN}{inner}"))).corners
    assert sorted(map(tuple, np.abs(corners))) == [pytest.approx((0.02, 0.03, 0.01))] * 8


def test_a_models_posture_is_kept_and_its_place_is_not(tmp_path):
    model = find_model(str(box_model(tmp_path, more="<pose>1 2 3 1.5707963267948966 0 0</pose>")))
    assert model.X_WB.translation() == pytest.approx([0, 0, 0])
    assert model.X_WB.rotation().matrix() @ [0, 1, 0] == pytest.approx([0, 0, 1])
    assert model.footprint.bottom == pytest.approx(-0.03)


def test_a_can_turns_about_its_axis_and_a_ball_about_all_three_through_the_centre_of_mass(tmp_path):
    can = "<cylinder><radius>0.03</radius><length>0.1</length></cylinder>"
    (axis,) = find_model(str(box_model(tmp_path, "can", shape=can))).axes
    assert np.abs(axis) == pytest.approx([0, 0, 1])
    ball = find_model(str(box_model(tmp_path, "ball", shape="<sphere><radius>0.03</radius></sphere>")))
    assert np.abs(np.linalg.det(ball.axes)) == pytest.approx(1)
    # Weighted on one side, a can is no body of revolution about its centre of mass.
    heavy = "<mass>0.2</mass><pose>0.01 0.0 0 0 0 0</pose>"
    assert len(find_model(str(box_model(tmp_path, "leaden", inertial=heavy, shape=can))).axes) == 0


@pytest.mark.parametrize(
    ("changed", "said"),
    [
        ({"inertial": "<mass>0</mass>"}, "has mass 0; an object needs a positive mass"),
        ({"more": "<static>true</static>"}, "is fixed to the world"),
        ({"more": "<link name='second'/>"}, "has 2 bodies"),
        ({"sees": ""}, "has nothing to see"),
    ],
)
def test_what_cannot_be_pushed_or_seen_is_no_object(tmp_path, changed, said):
    with pytest.raises(SceneError, match=said):
        find_model(str(box_model(tmp_path, **changed)))


def test_models_are_found_by_name_there_or_one_folder_down_and_no_deeper(tmp_path):
    (tmp_path / "low" / "deep").mkdir(parents=True)
    for folder, name in ((tmp_path, "b"), (tmp_path / "low", "model"), (tmp_path / "low" / "deep", "c")):
        box_model(folder, name)
    assert [model.name for model in find_models(str(tmp_path))] == ["b", "low"]
    assert [model.name for model in find_models([str(tmp_path)], ["low"])] == ["low"]
    for names in (["c"], ["b", "c"]):
        with pytest.raises(SceneError, match="no model c; there are b, low"):
            find_models(str(tmp_path), names)
    with pytest.raises(SceneError, match=r"no model lwo; did you mean low\?"):
        find_models(str(tmp_path), ["b", "lwo"])
    with pytest.raises(SceneError, match="both called b"):
        find_models([str(tmp_path), str(tmp_path)])
    with pytest.raises(SceneError, match="no folder; expected"):
        find_models([])
    with pytest.raises(SceneError, match="is not a folder"):
        find_models(str(tmp_path / "b.sdf"))


def test_one_model_is_found_by_its_file_or_as_the_only_one_of_its_folder(tmp_path):
    (tmp_path / "brick").mkdir()
    assert find_model(str(box_model(tmp_path / "brick", "model"))).name == "brick"
    assert find_model(str(tmp_path / "brick")).name == "brick"
    box_model(tmp_path / "brick", "second")
    with pytest.raises(SceneError, match="2 models in"):
        find_model(str(tmp_path / "brick"))
    with pytest.raises(SceneError, match="no file"):
        find_model(str(tmp_path / "gone.sdf"))


def test_models_that_say_no_inertia_are_named_in_one_line(tmp_path):
    box_model(tmp_path, "silent")
    box_model(tmp_path, "other", inertial=INERTIA.format(m=0.2, i=1e-4))
    with pytest.warns(Notice, match=r"^1 of 2 models say no moment of inertia \(silent\): SDF makes 1 kg m\^2"):
        find_models(str(tmp_path))
    for k in range(6):
        box_model(tmp_path, f"s{k}")
    with pytest.warns(Notice, match=r"^7 of 8 models .* \(s0, s1, s2, s3, s4, \.\.\.\)"):
        find_models(str(tmp_path))
    with pytest.warns(Notice, match=r"^1 of 1 models .* \(silent\)"):
        find_model(str(tmp_path / "silent.sdf"))
    with warnings.catch_warnings():
        warnings.simplefilter("error", Notice)
        find_model(str(tmp_path / "other.sdf"))
