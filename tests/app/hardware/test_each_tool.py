"""What the commands of a real robot ask of the arm before they move it, with each tool and either camera."""

import io
from itertools import pairwise
from types import SimpleNamespace

import numpy as np
import pytest
from rich.console import Console

from riseg_drake.app.diagram import make_diagram
from riseg_drake.app.hardware.arm_travel import ROOM, straight_motion
from riseg_drake.app.hardware.drive_arm import Checks, tool_load
from riseg_drake.app.hardware.dry_run import DryRun
from riseg_drake.app.hardware.hand_eye import _postures, _postures_in_view
from riseg_drake.app.planned_speed import planned_limits
from riseg_drake.app.run.interactions import Progress
from riseg_drake.app.scenario import load_scenario
from riseg_drake.robot.kinematics import PandaKinematics
from riseg_drake.robot.limits import PANDA_LIMITS
from tests.robot.own_tools import sdf

STAND = ", camera: {mount: world, X_WC: [1.0303, 0.0, 0.5503, -2.3562, 0.0, 1.5708]}"


def each(tool, mount):
    """On a stand the camera has the arm look for where it waits, which takes seconds."""
    marks = [pytest.mark.renders] if mount else []
    return pytest.param((tool, mount), id=f"{tool}, {'stand' if mount else 'wrist'}", marks=marks)


@pytest.fixture(params=[each(tool, mount) for tool in ("bar", "hand", "own.sdf") for mount in ("", STAND)])
def scenario(request, tmp_path):
    tool, mount = request.param
    (tmp_path / "own.sdf").write_text(sdf())
    path = tmp_path / "robot.yaml"
    path.write_text(f"station: !HardwareStationConfig {{panda: {{tool: {tool}}}{mount}}}\n")
    return load_scenario(path)


@pytest.fixture
def arm(scenario):
    return PandaKinematics(scenario.hardware.panda, scenario.hardware.camera.fixed_pose)


def test_hand_eye_has_free_ways_between_its_postures(scenario, arm):
    config = scenario.hardware
    postures = (_postures if config.camera.fixed_pose is None else _postures_in_view)(arm, config)
    assert len(postures) > 3
    for q_from, q_to in pairwise(postures):
        motion = straight_motion(arm, q_from, q_to, planned_limits(scenario))  # raises where it is not free
        for t in np.linspace(0, motion.end_time(), 20):
            q = motion.value(t)[:, 0]
            assert arm.clearance(q) > ROOM - 1e-3
            assert (PANDA_LIMITS.room(q) > 0).all()


def test_the_diagram_is_wired_and_a_dry_run_tells_of_that_tool_s_clearance(scenario, arm):
    make_diagram(scenario, seed=0)
    out, q = io.StringIO(), arm.ready
    run = DryRun(scenario, None, None, Console(file=out, width=200), Progress())
    path = SimpleNamespace(duration=1.0, position=lambda _: q)
    run.permit(SimpleNamespace(path=path, p_WB=np.zeros(3), p_WE=np.zeros(3), turned=False))
    assert f"nothing nearer than {1e3 * arm.clearance(q):.0f} mm" in out.getvalue()


def test_the_load_set_in_desk_is_compared_with_that_tool_s(scenario):
    panda, X_WC = scenario.hardware.panda, scenario.hardware.camera.fixed_pose
    mass, center = tool_load(panda, X_WC)
    bare = {"bar": 0.2, "hand": 0.73, "own": 0.3}
    camera = {"bar": 0.05 + 0.075, "hand": 0.05 + 0.06, "own": 0.0}
    name = panda.tool if panda.tool in bare else "own"
    assert mass == pytest.approx(bare[name] + (camera[name] if X_WC is None else 0.0))
    for wrong, problems in ((0.0, 0), (0.06, 1)):
        link = SimpleNamespace(load=lambda wrong=wrong: (mass + wrong, center))
        checks = Checks(link, panda, X_WC=X_WC)
        checks._load()
        assert len(checks.problems) == problems
