from types import SimpleNamespace

import numpy as np
import pytest
from pydrake.geometry import Meshcat

from riseg_drake.app.hardware.planned_motion import GLASS, PATH, PAUSE, PlannedMotion
from riseg_drake.app.meshcat_replay import replay
from riseg_drake.app.scenario import HARDWARE, load_scenario
from riseg_drake.robot.kinematics import READY, PandaKinematics
from tests.app.test_meshcat_push import push
from tests.browser import MISSING, opened

DURATION, TURN = 2.0, 0.3


def planned():
    """A push whose path turns joint 1."""
    path = SimpleNamespace(duration=DURATION, position=lambda t: READY + np.eye(7)[0] * TURN * t / DURATION)
    return push(path=path)


@pytest.fixture
def scene(monkeypatch):
    """Meshcat, what shows the motion, the clock, and the joint angles at which it was shown."""
    meshcat, clock, shown = Meshcat(), SimpleNamespace(now=1.7e9), []
    motion = PlannedMotion(load_scenario(None, HARDWARE), meshcat, lambda: clock.now)
    place = motion._place
    monkeypatch.setattr(motion, "_place", lambda q, now: (shown.append(q), place(q, now)))
    return meshcat, motion, clock, shown


def test_the_arm_of_glass_is_where_the_motion_would_be_and_begins_again(scene):
    _, motion, clock, shown = scene
    wanted = planned()
    for passed in (0.0, 0.5, DURATION, DURATION + 0.9 * PAUSE, DURATION + PAUSE + 0.5):
        clock.now = 1.7e9 + passed
        motion.show(wanted)
        turned = TURN * min(passed % (DURATION + PAUSE), DURATION) / DURATION
        np.testing.assert_allclose(shown[-1] - READY, np.eye(7)[0] * turned, atol=1e-6)


def test_arm_and_way_are_drawn(scene):
    meshcat, motion, *_ = scene
    motion.show(planned())
    for part in ("arm", "way"):
        assert meshcat.HasPath(f"{PATH}/{part}")


def test_the_way_that_is_drawn_is_the_tips(scene):
    _, motion, *_ = scene
    ways = []

    class Paper(SimpleNamespace):
        def SetLine(self, path, vertices, *_):
            ways.append(vertices)

        def SetProperty(self, *_):
            pass

    motion._meshcat = Paper()
    wanted = planned()
    motion.show(wanted)
    kinematics = PandaKinematics()
    for k, t in ((0, 0.0), (-1, DURATION)):
        np.testing.assert_allclose(ways[0][:, k], kinematics.X_WE(wanted.path.position(t))[:3, 3], atol=1e-12)


def test_it_is_kept_at_wall_time_in_a_recording_that_begins_then(scene):
    meshcat, motion, clock, _ = scene
    meshcat.StartRecording()
    meshcat.get_mutable_recording().set_start_time(clock.now - 1.0)
    motion.show(planned())
    motion.hide()
    meshcat.PublishRecording()


WAYS = """
    () => {
      const planned = viewer.scene_tree.find(["riseg", "planned"]);
      const ways = Object.entries(planned.children["way"].children);
      return planned.object.visible ? ways.filter(([_, way]) => way.object.visible).map(([name]) => name) : [];
    }
"""
OPACITIES = """
    () => {
      const found = [];
      viewer.scene_tree.find(["riseg", "planned", "arm"]).object.traverse(part => {
        if (part.material) found.push(...[part.material].flat().map(each => each.opacity));
      });
      return found;
    }
"""


@pytest.mark.renders
@pytest.mark.skipif(bool(MISSING), reason=MISSING)
@pytest.mark.parametrize("kind", ["live", "replay"])
def test_the_arm_is_of_glass_for_who_opens_the_page_later_too(scene, tmp_path, kind):
    meshcat, motion, *_ = scene
    motion.show(planned())
    (tmp_path / "replay.html").write_text(meshcat.StaticHtml())
    url = meshcat.web_url() if kind == "live" else (tmp_path / "replay.html").as_uri()
    with opened(url) as page:
        page.wait(f"({OPACITIES})().length >= {len(motion._parts)}")
        assert set(page.ask(f"({OPACITIES})()")) == {GLASS}


@pytest.mark.renders
@pytest.mark.skipif(bool(MISSING), reason=MISSING)
def test_a_replay_shows_each_planned_way_in_its_time_alone(scene, tmp_path):
    meshcat, motion, clock, _ = scene
    file = tmp_path / "replay.html"
    with replay(meshcat, file, start=clock.now):
        for _ in range(2):  # from 1 s on, and from 2 s on
            clock.now += 1.0
            motion.show(planned())
        clock.now += 1.0
        motion.hide()
    with opened(file.as_uri()) as page:
        page.wait("viewer.animator.duration > 0")
        page.ask("viewer.animator.pause()")
        for time, shown in ((0.5, []), (1.5, ["1"]), (2.5, ["2"]), (3.0, [])):
            page.ask(f"viewer.animator.seek({time})")
            assert page.ask(f"({WAYS})()") == shown, time
