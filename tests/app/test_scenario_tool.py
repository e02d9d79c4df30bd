"""The tool that a scenario names: built in, or a file beside the scenario; what is wrong with it."""

import pytest

from riseg_drake.app.cli import main
from riseg_drake.app.scenario import HARDWARE, load_scenario
from riseg_drake.app.scenario_file import ScenarioError
from riseg_drake.robot.kinematics import PandaKinematics
from tests.robot.own_tools import TIP, sdf

STAND = "  camera: {mount: world, X_WC: [1.03, 0.0, 0.55, -2.356, 0.0, 1.571]}\n"


@pytest.fixture
def scenario(tmp_path):
    """Called, the path of a scenario with the tool `tools/own.sdf` beside it."""

    def written(text, tool="tools/own.sdf", station="", more=""):
        (tmp_path / "tools").mkdir(exist_ok=True)
        (tmp_path / "tools" / "own.sdf").write_text(text)
        path = tmp_path / "mine.yaml"
        path.write_text(f"station: {station}\n  panda: {{tool: {tool}}}\n{more}")
        return path

    return written


@pytest.mark.parametrize("name", ["simulation", "fixed_camera", HARDWARE])
def test_without_a_word_the_tool_is_the_bar(name):
    assert load_scenario(None, name).station.panda.tool == "bar"


def test_the_built_in_scenario_of_the_hand_has_it_and_a_camera_that_sees_its_fingertips():
    scenario = load_scenario(None, "hand")
    arm = PandaKinematics(scenario.station.panda)
    assert scenario.station.panda.tool == "hand"
    assert -arm.X_EC[2, 3] > scenario.station.camera.depth_min
    # From where the camera looks to the tip, in the picture: at its lower edge, and no lower.
    k, p_CE = scenario.station.camera.intrinsics, -arm.X_EC[:3, :3].T @ arm.X_EC[:3, 3]
    assert 0.8 * k.height < k.cy + k.fy * p_CE[1] / p_CE[2] < 1.1 * k.height


def test_a_tool_of_ones_own_lies_beside_the_scenario_wherever_one_is(scenario, monkeypatch, tmp_path_factory):
    path = scenario(sdf())
    monkeypatch.chdir(tmp_path_factory.mktemp("elsewhere"))
    panda = load_scenario(path).station.panda
    assert panda.tool == str(path.parent / "tools" / "own.sdf")
    assert PandaKinematics(panda).tool.length == 0.2


def test_an_absolute_path_is_taken_as_it_is(scenario, tmp_path):
    path = scenario(sdf(), tool=tmp_path / "tools" / "own.sdf")
    assert load_scenario(path).station.panda.tool == str(tmp_path / "tools" / "own.sdf")


@pytest.mark.parametrize("station", ["", "!HardwareStationConfig"])
def test_a_tool_without_a_camera_does_where_the_camera_is_on_a_stand_and_not_on_the_wrist(scenario, station):
    text = sdf(frames=TIP)
    assert load_scenario(scenario(text, station=station, more=STAND)).station.panda.tool.endswith("own.sdf")
    with pytest.raises(ScenarioError, match="no frame `camera`"):
        load_scenario(scenario(text, station=station))


def test_what_is_wrong_with_a_tool_is_one_line_with_exit_code_2(scenario, capsys):
    for text, tool, words in (
        (sdf(), "hnad", "hnad: no SDF or URDF file; a tool is bar, hand or an .sdf or .urdf file"),
        (sdf(), "tools/gone.sdf", "gone.sdf: no file"),
        (sdf(shapes=""), "tools/own.sdf", "no collision geometry"),
        ("nothing", "tools/own.sdf", "cannot be read"),
    ):
        path = scenario(text, tool)
        assert main(["diagram", str(path)]) == 2
        said = capsys.readouterr().err
        assert words in said
        assert said.startswith(f"riseg: {path}: station.panda.tool: ")
        assert said.count("\n") == 1
        assert "Traceback" not in said
