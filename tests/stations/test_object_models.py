import pytest

from riseg_drake.stations.object_models import SceneError, find_models

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
