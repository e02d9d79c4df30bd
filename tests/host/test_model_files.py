"""Model files are looked at before Drake's parsers see them."""

import json
import os

import pytest
from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import MultibodyPlant

from riseg_drake.host.model_files import ModelFileError, check_model
from riseg_drake.robot.description import find_packages
from riseg_drake.stations.object_models import SceneError, find_models

BOX = """<robot name="box"><link name="box"><inertial><mass value="0.1"/>
<inertia ixx="1e-4" ixy="0" ixz="0" iyy="1e-4" iyz="0" izz="1e-4"/></inertial>
<collision><geometry><box size="0.1 0.1 0.05"/></geometry></collision></link></robot>"""


@pytest.mark.parametrize(
    ("content", "says"),
    [
        (BOX.replace("0.1 0.1 0.05", "0.1 0.1"), "cannot be read"),
        (BOX.replace("0.1 0.1 0.05", "nan 0.1 0.1"), "cannot be read"),
        (BOX[:-30], "not whole XML"),
        ("<a>" * 200 + "</a>" * 200, "nested too deeply"),
        ('<!DOCTYPE a [<!ENTITY x "y">]><a>&x;</a>', "entities of its own"),
        (BOX.replace('link name="box', 'link name="box' + 1000 * "x"), "more than 1000 letters"),
        ("", "not whole XML"),
    ],
)
def test_a_model_that_cannot_be_is_one_line(tmp_path, content, says):
    (tmp_path / "box.urdf").write_text(content)
    with pytest.raises(SceneError, match=says) as error:
        find_models(str(tmp_path))
    assert "box.urdf" in str(error.value)
    assert "\n" not in str(error.value)


BALL = """<?xml version="1.0"?><sdf version="1.7"><model name="ball"><link name="ball">
<inertial><mass>0.1</mass></inertial><collision name="c"><geometry><sphere><radius>0.03</radius></sphere>
</geometry></collision></link></model></sdf>"""
NO_BODYS_INERTIA = "<inertia><ixx>1e-4</ixx><iyy>1e-4</iyy><izz>1</izz></inertia>"


@pytest.mark.parametrize(
    ("content", "says"),
    [
        (BALL.replace("<mass>0.1", "<mass>0.1 0.1"), "could not convert string to float"),
        (BALL.replace("<?xml ", "<?: "), "not well-formed"),
        (BALL.replace("<mass>0.1", "<mass>[[["), "Error reading element <mass>"),
        (BALL.replace("</mass>", "</mass>" + NO_BODYS_INERTIA), "ball has invalid inertia"),
    ],
)
def test_what_drake_only_logs_is_one_line_too(tmp_path, content, says, capfd):
    (tmp_path / "ball.sdf").write_text(content)
    with pytest.raises(SceneError, match=says) as error:
        find_models(str(tmp_path))
    assert "\n" not in str(error.value)
    assert capfd.readouterr().err == ""


def test_a_shape_too_thin_to_stand_on_is_one_line(tmp_path):
    (tmp_path / "mesh.obj").write_text(
        "v 0 0 0\nv 1e-312 0 0\nv 0 1e-312 1\nv 0 0 1\nf 1 2 3\nf 1 4 2\nf 2 4 3\nf 1 3 4\n"
    )
    thin = BALL.replace("<sphere><radius>0.03</radius></sphere>", "<mesh><uri>mesh.obj</uri></mesh>")
    visual = '<visual name="v"><geometry><sphere><radius>0.03</radius></sphere></geometry></visual></link>'
    (tmp_path / "ball.sdf").write_text(thin.replace("</link>", visual))
    with pytest.raises(SceneError, match=r"ball\.sdf") as error:
        find_models(str(tmp_path))
    assert "\n" not in str(error.value)


def test_a_pipe_in_the_place_of_a_model_hangs_nobody(tmp_path):
    os.mkfifo(tmp_path / "box.urdf")
    with pytest.raises(SceneError, match=r"box\.urdf cannot be read: is a pipe, not a file"):
        find_models(str(tmp_path))


def test_a_right_model_passes(tmp_path):
    (tmp_path / "box.urdf").write_text(BOX)
    check_model(tmp_path / "box.urdf")
    with pytest.raises(ModelFileError):
        check_model(tmp_path / "nowhere.urdf")


_SHAPE = "<{0}><link name='a'><visual name='v'><geometry>{1}</geometry></visual></link></{0}>"
MESH = {
    "box.urdf": _SHAPE.format("robot", "<mesh filename='{}'/>"),
    "box.sdf": _SHAPE.format("model", "<mesh><uri>{}</uri></mesh>"),
    "box.xml": "<mujoco><asset><mesh name='a' file='{}'/></asset></mujoco>",
}


@pytest.mark.parametrize("name", MESH)
@pytest.mark.parametrize("scheme", ["", "file://"])
@pytest.mark.parametrize("kind", ["pipe", "device"])
def test_a_mesh_that_is_no_file_is_one_line_and_hangs_nobody(tmp_path, name, scheme, kind):
    if kind == "pipe":
        os.mkfifo(tmp_path / "mesh.obj")
    else:
        (tmp_path / "mesh.obj").symlink_to("/dev/zero")
    uri = f"{scheme}{tmp_path / 'mesh.obj'}" if scheme else "mesh.obj"
    (tmp_path / name).write_text(MESH[name].format(uri))
    with pytest.raises(ModelFileError, match=r"its mesh .*mesh\.obj is not a file"):
        check_model(tmp_path / name)


@pytest.mark.parametrize("name", MESH)
@pytest.mark.parametrize("uri", ["mesh.obj", "nowhere.obj", "package://other/mesh.obj"])
def test_meshes_that_are_files_or_drakes_to_find_pass(tmp_path, name, uri):
    (tmp_path / "mesh.obj").write_text("v 0 0 0")
    (tmp_path / name).write_text(MESH[name].format(uri))
    check_model(tmp_path / name)


@pytest.mark.parametrize("scheme", ["package", "model"])
@pytest.mark.parametrize("name", MESH)
def test_a_mesh_of_a_package_beside_the_model_is_looked_at_too(tmp_path, name, scheme):
    (tmp_path / "gantry").mkdir()
    os.mkfifo(tmp_path / "gantry" / "mesh.obj")
    (tmp_path / "gantry" / name).write_text(MESH[name].format(f"{scheme}://gantry/mesh.obj"))
    with pytest.raises(ModelFileError, match=r"its mesh .*gantry/mesh\.obj is not a file"):
        find_packages(Parser(MultibodyPlant(0.0)), tmp_path / "gantry" / name)


OBJ = "mtllib {}\nv 0 0 0\nv .1 0 0\nv 0 .1 0\nv 0 0 .1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 1 4 3\n"
PARTS = {
    "material": {"mesh.obj": OBJ.format("part")},
    "texture": {"mesh.obj": OBJ.format("a b.mtl"), "a b.mtl": "newmtl m\nmap_Kd -s 1 1 1 part\n"},
    "buffer": {"mesh.gltf": json.dumps({"buffers": [{"byteLength": 4, "uri": "p%61rt"}]})},
    "image": {"mesh.gltf": json.dumps({"images": [{"uri": "data:image/png;base64,"}, {"uri": "part"}]})},
}


@pytest.mark.parametrize("files", PARTS.values(), ids=PARTS)
def test_what_a_mesh_names_is_looked_at_too(tmp_path, files):
    (tmp_path / "box.urdf").write_text(MESH["box.urdf"].format(next(iter(files))))
    for name, content in files.items():
        (tmp_path / name).write_text(content)
    check_model(tmp_path / "box.urdf")
    (tmp_path / "part").write_text("")
    check_model(tmp_path / "box.urdf")
    (tmp_path / "part").unlink()
    os.mkfifo(tmp_path / "part")
    with pytest.raises(ModelFileError, match=r"its mesh's part .*/part is not a file"):
        check_model(tmp_path / "box.urdf")


@pytest.mark.parametrize(
    "content", ["[[[", "[1]", '{"buffers": 3, "images": [{"uri": 7}, 1]}', "\xff", "[" * 10**5]
)
def test_gltf_that_is_none_is_for_its_reader_to_refuse(tmp_path, content):
    (tmp_path / "box.urdf").write_text(MESH["box.urdf"].format("mesh.gltf"))
    (tmp_path / "mesh.gltf").write_text(content)
    check_model(tmp_path / "box.urdf")


def test_materials_that_name_themselves_or_nothing_come_to_an_end(tmp_path):
    (tmp_path / "box.urdf").write_text(MESH["box.urdf"].format("mesh.obj"))
    (tmp_path / "mesh.obj").write_text(OBJ.format("a.mtl") + "mtllib \x1c\nmtllib \t \n")
    (tmp_path / "a.mtl").write_text("map_Kd a.mtl\nmap_Kd \n")
    check_model(tmp_path / "box.urdf")
