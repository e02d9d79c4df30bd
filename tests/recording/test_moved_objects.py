"""Drawn objects that move by known motions before a camera at rest; poses that err where nothing moves."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from riseg_drake.app.replay import Replay
from riseg_drake.app.scenario import Scenario
from riseg_drake.evaluation.scores import score
from riseg_drake.geometry.camera import Intrinsics
from riseg_drake.recording.layout import RecordedFrame
from riseg_drake.systems.frame_view import FrameView
from tests.recording.moved_objects import moved_film, sideways
from tests.segmentation.drawn_scene import CAMERA, Blank, DrawnScene, Texture, looking_down, planar

pytestmark = pytest.mark.renders

VGA = Intrinsics(640, 480, 616.2, 615.8, 316.4, 238.8)
SIZES = [(0.07, 0.06, 0.03), (0.06, 0.08, 0.05), (0.05, 0.05, 0.04)]
PLACES = [planar(-0.08, 0.03, 0.3), planar(0.05, 0.05), planar(0.02, -0.07, 1.0)]


@pytest.mark.parametrize(
    ("speed", "frames", "intrinsics"), [(0.5, 16, CAMERA), (2.0, 8, CAMERA), (5.0, 7, VGA)]
)
@pytest.mark.parametrize("tilt", [0.0, 0.5], ids=["from above", "from beside"])
def test_each_object_that_moves_is_found_with_overlap_f_above_85(speed, frames, intrinsics, tilt) -> None:
    table = Texture(9, contrast=8) if tilt else Blank()
    camera = looking_down(y=-0.45 * np.tan(tilt), tilt=tilt)
    frame, labels = DrawnScene(SIZES, table=table, intrinsics=intrinsics).frame(
        0, camera, PLACES, np.random.default_rng(0)
    )
    directions = {1: (-0.9, 0.4), 3: (0.3, 0.95)}
    z = {i: float(np.median(frame.depth[labels == i])) for i in directions}
    twists = {i: sideways(speed * np.array(d), z[i], intrinsics, 0.005) for i, d in directions.items()}
    replay = Replay(Scenario(), FrameView(intrinsics, None, None), seed=0)
    film = moved_film(frame.color, frame.depth, labels, intrinsics, twists, frames, np.random.default_rng(1))
    for film_frame in film:
        mask = replay.mask_after(film_frame)
    truth = np.where(np.isin(film_frame.labels, list(twists)), film_frame.labels, 0)
    scores = score(mask, truth)
    assert scores.objects_found == 2
    assert scores.overlap_f >= 0.85


@pytest.mark.parametrize("table", [Blank(), Texture(9, contrast=8)], ids=["blank table", "textured table"])
def test_nothing_is_found_where_nothing_moves_though_poses_err(table) -> None:
    rng = np.random.default_rng(3)
    scene = DrawnScene(SIZES, table=table)
    replay = Replay(Scenario(), FrameView(CAMERA, None, None), seed=0)
    for k in range(12):
        X_WC = looking_down(0.01 * np.sin(k / 4), 0.01 * np.cos(k / 4), tilt=0.05 * np.sin(k / 5))
        frame, _ = scene.frame(k, X_WC, PLACES, rng)
        error = np.eye(4)
        error[:3, :3] = Rotation.from_rotvec(np.radians(0.1) * rng.normal(size=3)).as_matrix()
        error[:3, 3] = 0.001 * rng.normal(size=3)
        mask = replay.mask_after(RecordedFrame(k / 15, frame.color, frame.depth, X_WC @ error))
        assert not mask.any()
    assert replay.segmentation.object_ids == ()
