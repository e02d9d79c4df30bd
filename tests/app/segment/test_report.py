import numpy as np

from riseg_drake.app.segment import report as module
from riseg_drake.app.segment.report import Album
from riseg_drake.recording.layout import RecordedFrame
from riseg_drake.segmentation.segmentation import Segmentation

SUMMARY = {"seed": 3, "state": "done", "end": "all frames were read"}


def known(ids):
    """Objects of these ids, side by side."""
    mask = np.zeros((24, 32), np.uint16)
    for object_id in ids:
        mask[5:10, 5 * object_id : 5 * object_id + 4] = object_id
    return Segmentation(0, mask)


def page_of(*seen):
    album = Album()
    for k, ids in enumerate(seen):
        color = np.full((24, 32, 3), 7 * k % 250, np.uint8)
        album.look(RecordedFrame(10.0 + k, color, np.ones((24, 32), np.float32)), known(ids))
    return album.page("mine", SUMMARY, [], {})


def test_it_shows_the_first_frame_each_change_of_what_is_known_and_the_last_frame():
    page = page_of([], [], [1], [1], [1, 2], [1, 2], [1, 2])
    for title in ("From 0.0 s to 2.0 s", "From 2.0 s to 4.0 s", "From 4.0 s to 6.0 s"):
        assert f"<h2>{title}</h2>" in page
    assert page.count('<section class="moment">') == 3


def test_a_last_frame_that_brought_something_new_is_not_shown_twice():
    assert page_of([], [1]).count('<section class="moment">') == 1


def test_a_long_recording_has_a_short_report_with_its_first_and_its_last_frame():
    page = page_of(*([k % 6] for k in range(1, 400)))
    assert page.count('<section class="moment">') < module.MOST_VIEWS
    assert "From 0.0 s" in page
    assert "to 398.0 s" in page


def test_a_recording_of_which_nothing_was_read_has_a_page_that_says_so():
    page = Album().page("mine", {**SUMMARY, "state": "failed", "end": "no frame shows a table"}, [], {})
    assert "Failed: no frame shows a table." in page
