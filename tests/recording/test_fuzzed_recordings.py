"""A small share of `nightly_fuzzed_recordings.py`, for every day."""

from hypothesis import given, settings

from tests.recording.fuzzed import SETTINGS, camera, check, edits


@settings(max_examples=12, **SETTINGS)
@given(changes=edits, camera_changes=camera)
def test_a_mutated_recording_gives_masks_or_one_line(whole, tmp_path_factory, changes, camera_changes):
    check(
        whole,
        tmp_path_factory.getbasetemp() / "fuzzed",
        changes,
        camera_changes,
    )
