"""CameraMotion through its ports."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from riseg_drake.geometry.rgbd import NO_PAIR
from riseg_drake.segmentation.camera_motion import CameraMotionParameters, PoseError, settled_pair
from riseg_drake.segmentation.noise import MeasurementNoise
from riseg_drake.systems.camera_motion import CameraMotion
from tests.systems.ports import evaluate, port_names

WRONG_BY = np.radians(0.3)
EXACT = PoseError()
ERRING = PoseError(tilt_squares=60 * WRONG_BY**2, height_squares=30 * 0.001**2, frames=30.0)
"""After 30 frames in which the table tilted so much."""


@pytest.fixture(scope="module")
def wrong(payloads):
    """The pair with a pose that is turned about the camera's x and y."""
    X_WC = payloads.pair.current.X_WC.copy()
    X_WC[:3, :3] @= Rotation.from_rotvec([WRONG_BY, -WRONG_BY, 0]).as_matrix()
    return replace(payloads.pair, current=replace(payloads.pair.current, X_WC=X_WC))


def settled(payloads, pair, error, parameters=None, noise=None):
    return evaluate(
        CameraMotion(parameters, noise),
        "pair",
        pair=pair,
        optical_flow=payloads.optical_flow,
        above_table_reference=payloads.above_0,
        above_table=payloads.above_1,
        pose_error=error,
    )


def turned_by(pair, true) -> float:
    """By how much the motion between the frames is turned against the true one, rad."""
    return Rotation.from_matrix(pair.X_C1C0[:3, :3].T @ true.X_C1C0[:3, :3]).magnitude()


def test_ports_have_the_names_of_the_contract() -> None:
    assert port_names(CameraMotion()) == (
        ["pair", "optical_flow", "above_table_reference", "above_table", "pose_error"],
        ["pair"],
    )
    assert CameraMotion().get_name() == "CameraMotion"


def test_before_the_first_pair_there_is_none(payloads) -> None:
    assert settled(payloads, NO_PAIR, ERRING) is NO_PAIR


def test_where_poses_are_exact_the_pair_goes_through_as_it_is(payloads, wrong) -> None:
    assert settled(payloads, wrong, EXACT) is wrong


def test_where_they_err_the_motion_is_set_right_by_what_stands_still(payloads, wrong) -> None:
    pair = settled(payloads, wrong, ERRING)
    assert turned_by(wrong, payloads.pair) == pytest.approx(np.sqrt(2) * WRONG_BY)
    assert turned_by(pair, payloads.pair) < turned_by(wrong, payloads.pair) / 3
    assert pair.reference is wrong.reference
    assert pair.current.color is wrong.current.color


@pytest.mark.parametrize(
    ("parameters", "noise"),
    [(None, None), (CameraMotionParameters(points=1000), None), (None, MeasurementNoise(flow=1.0))],
    ids=["as they are", "other parameters", "another noise"],
)
def test_it_is_what_the_function_makes_of_the_inputs(payloads, wrong, parameters, noise) -> None:
    pair = settled(payloads, wrong, ERRING, parameters, noise)
    expected = settled_pair(
        wrong,
        payloads.optical_flow,
        payloads.above_0,
        payloads.above_1,
        ERRING,
        noise or MeasurementNoise(),
        parameters or CameraMotionParameters(),
    )
    np.testing.assert_array_equal(pair.X_C1C0, expected.X_C1C0)
    assert pair.residual == expected.residual
    if parameters or noise:
        assert (pair.X_C1C0 != settled(payloads, wrong, ERRING).X_C1C0).any()


def test_who_does_not_mind_an_error_gets_the_pair_as_it_is(payloads, wrong) -> None:
    assert settled(payloads, wrong, ERRING, CameraMotionParameters(exact=1e6)) is wrong
