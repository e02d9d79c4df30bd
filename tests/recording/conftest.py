import pytest

from tests.recording.fuzzed import CAMERA
from tests.recording.made_recordings import drawn_frames, write


@pytest.fixture(scope="session")
def whole(tmp_path_factory):
    """A recording of four frames with everything that one can hold but joints and robot masks."""
    return write(tmp_path_factory.mktemp("whole") / "recording", drawn_frames(4, CAMERA), CAMERA)
