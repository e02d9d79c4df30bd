import pytest
import trimesh

from riseg_drake.stations.object_models import SceneError, find_models, with_remedy

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
