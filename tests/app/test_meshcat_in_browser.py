"""The live page and the replay as a browser has them."""

import json
import re

import cv2
import numpy as np
import pytest
from pydrake.geometry import Meshcat

from riseg_drake.app.output import REPLAY, RunFolder
from riseg_drake.app.run.command import run
from riseg_drake.app.scenario import load_scenario
from tests.browser import MISSING, opened

pytestmark = [pytest.mark.renders, pytest.mark.skipif(bool(MISSING), reason=MISSING)]

SHOWN = """
    () => {
      const found = [];
      const look = (node, path) => {
        if (!node.object.visible) return;
        if (path.startsWith("/riseg/") && path.endsWith("/<object>")) found.push(path);
        for (const [child, next] of Object.entries(node.children)) look(next, path + "/" + child);
      };
      look(viewer.scene_tree.find([]), "");
      return found;
    }
"""
PIXELS_OF_PANEL = """
    () => {
      let sizes = [];
      viewer.scene_tree.find(["riseg", "panel"]).object.traverse(part => {
        const image = part.material?.map?.image;
        if (image) sizes.push([image.width, image.height]);
      });
      return sizes;
    }
"""


@pytest.fixture(scope="module")
def seen(small_scenario, tmp_path_factory):
    """The server of a run that is over, and its folder."""
    meshcat, path = Meshcat(), tmp_path_factory.mktemp("run") / "out"
    with RunFolder(path, {"scenario": "small", "seed": 1}) as folder:
        run(load_scenario(small_scenario), 1, folder, meshcat=meshcat)
    return meshcat, path


@pytest.fixture
def found(seen):
    """The ids in the last mask."""
    steps = sorted(seen[1].glob("step_*"))
    return np.unique(cv2.imread(str(steps[-1] / "mask.png"), cv2.IMREAD_UNCHANGED))[1:]


@pytest.fixture(scope="module", params=["live", "replay"])
def page(request, seen):
    meshcat, path = seen
    url = meshcat.web_url() if request.param == "live" else (path / REPLAY).as_uri()
    with opened(url) as shown:
        shown.wait("viewer.animator.duration > 0")
        shown.wait(f"({PIXELS_OF_PANEL})().length > 0")
        yield shown


def test_the_page_complains_of_nothing(page):
    assert page.complaints == []


def test_the_cameras_picture_with_its_caption_is_there(page):
    # 320 pixels wide; below 240 rows stands a line of a tenth of the width.
    assert page.ask(f"({PIXELS_OF_PANEL})()")[0] == [320, 280]


def test_the_objects_that_were_found_are_labelled_at_its_end(page, found):
    page.ask("viewer.animator.pause()")
    page.ask("viewer.animator.seek(viewer.animator.duration)")
    shown = page.ask(f"({SHOWN})()")
    panels = [int(match[1]) for path in shown if (match := re.match(r"/riseg/panel/(\d+)/", path))]
    assert panels == [max(panels) - 2, max(panels) - 1, max(panels)]
    labels = [match[1] for path in shown if (match := re.match(r"/riseg/labels/(\d+)/", path))]
    assert labels == [str(object_id) for object_id in found]


def test_at_its_end_the_labels_say_what_was_decided_last_and_no_push_is_left(page, seen):
    page.ask("viewer.animator.pause()")
    page.ask("viewer.animator.seek(viewer.animator.duration)")
    shown = page.ask(f"({SHOWN})()")
    confidence = json.loads((seen[1] / "summary.json").read_text())["steps"][-1]["confidence"]
    expected = {object_id: f"{100 * sure:.0f}_%" for object_id, sure in confidence.items()}
    labels = [match for path in shown if (match := re.match(r"/riseg/labels/(\d+)/(\d+)__(\d+_%)", path))]
    assert {match[1]: match[3] for match in labels} == expected
    assert not [path for path in shown if path.startswith("/riseg/push/")]


def test_it_opens_in_front_of_the_robot_and_above_the_table(page):
    # three.js has y where Drake has z.
    x, y, z = page.ask("viewer.camera.getWorldPosition(viewer.camera.position.clone()).toArray()")
    assert (x, y, -z) == pytest.approx((0.5 + 0.72, 0.66, 0.0), abs=1e-3)


def test_its_time_runs(page):
    page.ask("viewer.animator.pause()")
    page.ask("viewer.animator.reset()")
    page.ask("viewer.animator.play()")
    page.wait("viewer.animator.time > 0.1")


def test_an_interaction_is_found_again_by_its_mark(page):
    marks = "document.querySelectorAll('#riseg-track a')"
    if page.ask("location.protocol === 'http:'"):  # the live page is Meshcat's own
        assert page.ask(f"{marks}.length") == 0
        return
    assert page.ask(f"{marks}.length") == 1
    page.ask(f"{marks}[0].onclick()")
    share = float(page.ask(f"{marks}[0].style.left")[:-1]) / 100
    expected = share * page.ask("viewer.animator.duration")
    assert page.ask("viewer.animator.time") == pytest.approx(expected, abs=0.02)
    assert page.complaints == []
