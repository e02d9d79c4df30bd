"""2500 mutated recordings; a minute or a few. Not collected by default, since its name is no test's:

python -m pytest tests/recording/nightly_fuzzed_recordings.py
"""

from hypothesis import given, settings

from tests.recording.fuzzed import SETTINGS, camera, check, edits


@settings(max_examples=2500, **SETTINGS)
@given(changes=edits, camera_changes=camera)
def test_every_mutated_recording_gives_masks_or_one_line(whole, tmp_path_factory, changes, camera_changes):
    check(
        whole,
        tmp_path_factory.getbasetemp() / "fuzzed",
        changes,
        camera_changes,
    )
