import pytest

SMALL = """\
station:
  scene: {count_min: 2, count_max: 2}
  camera: {width: 320, height: 240, fx: 308.1, fy: 307.9, cx: 150.7, cy: 116.4}
arm: {most_interactions: 1}
"""


@pytest.fixture(scope="session")
def small_scenario(tmp_path_factory):
    """The file of a scene with two objects and a quarter of the pixels, for one interaction."""
    path = tmp_path_factory.mktemp("scenarios") / "small.yaml"
    path.write_text(SMALL)
    return path
