"""How a replay begins and ends, in a browser, and what the live view shows once it was kept."""

from itertools import count

import numpy as np
import pytest
from pydrake.geometry import Box, Meshcat, Rgba

from riseg_drake.app.meshcat_replay import FRAME_RATE, replay
from riseg_drake.app.output import REPLAY
from tests.browser import MISSING, opened

pytestmark = [pytest.mark.renders, pytest.mark.skipif(bool(MISSING), reason=MISSING)]

LAST = "viewer.scene_tree.find(['riseg', 'last']).object.visible"
SLIDER = "document.querySelector('#riseg-track input')"
BUTTON = "document.querySelector('#riseg-time button')"


def moment_lost_by_the_slider():
    """s; the end of a replay, which the 15 digits that a slider keeps put before itself."""
    kept = (float(np.float32(frame / FRAME_RATE)) for frame in count(60))
    return next(end for end in kept if float(f"{end:.15g}") < end)


@pytest.fixture(scope="module")
def kept(tmp_path_factory):
    """The server of a replay in which one thing appears at the very end, and the replay's file."""
    meshcat, file = Meshcat(), tmp_path_factory.mktemp("replay") / REPLAY
    with replay(meshcat, file):
        meshcat.SetObject("/riseg/last", Box(0.1, 0.1, 0.1), Rgba(1, 0, 0))
        meshcat.SetProperty("/riseg/last", "visible", False, 0.0)
        within_the_frame = moment_lost_by_the_slider() + 0.25 / FRAME_RATE
        meshcat.SetProperty("/riseg/last", "visible", True, within_the_frame)
    return meshcat, file


def test_who_opens_the_live_view_after_the_run_sees_how_it_ended(kept):
    with opened(kept[0].web_url()) as page:
        page.wait("viewer.animator.duration > 0")
        assert page.ask(f"[viewer.animator.time, {LAST}]") == [0, True]
        page.ask("viewer.animator.reset(); viewer.animator.play()")
        page.wait(f"!{LAST}")


def test_a_replay_plays_by_itself_and_then_offers_to_play_again(kept):
    with opened(kept[1].as_uri()) as page:
        for _ in range(2):
            page.wait("viewer.animator.time > 0.1 && viewer.animator.time < viewer.animator.duration")
            page.wait(f"{BUTTON}.textContent === 'play'")
            assert page.ask(LAST)
            page.ask(f"{BUTTON}.click()")


def test_the_end_of_the_slider_shows_what_comes_at_the_very_end(kept):
    with opened(kept[1].as_uri()) as page:
        page.wait(f"Number({SLIDER}.max) === viewer.animator.duration")
        assert page.ask("viewer.animator.duration") == moment_lost_by_the_slider()
        for value, shown in ((f"{SLIDER}.max / 2", False), (f"{SLIDER}.max", True)):
            page.ask(f"{SLIDER}.value = {value}; {SLIDER}.dispatchEvent(new Event('input'))")
            assert page.ask(LAST) == shown
