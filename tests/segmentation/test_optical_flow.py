"""Dense inverse search against images that are shifted by a known amount."""

import numpy as np
import pytest

from riseg_drake.segmentation.optical_flow import DIS_PRESETS, DisFlow, DisFlowParameters
from tests.segmentation.drawn_scene import Texture

HEIGHT, WIDTH = 120, 160
INTERIOR = (slice(16, -16), slice(16, -16))


def shifted(du: float, dv: float) -> np.ndarray:
    """A textured image [H, W, 3], moved by (du, dv) pixels."""
    v, u = np.mgrid[:HEIGHT, :WIDTH].astype(float)
    metres = np.stack([u - du, v - dv, np.zeros_like(u)], axis=-1).reshape(-1, 3) * 0.001
    color = Texture(seed=3).color(metres).reshape(HEIGHT, WIDTH, 3)
    return np.clip(np.rint(color), 0, 255).astype(np.uint8)


@pytest.mark.parametrize("preset", DIS_PRESETS)
@pytest.mark.parametrize("shift", [(0.0, 0.0), (0.5, -0.25), (2.3, 1.7)])
def test_a_shifted_texture_flows_by_its_shift(preset: str, shift: tuple[float, float]) -> None:
    flow = DisFlow(DisFlowParameters(preset=preset))(shifted(0, 0), shifted(*shift))
    assert flow.shape == (HEIGHT, WIDTH, 2)
    assert flow.dtype == np.float32
    error = np.linalg.norm(flow[INTERIOR] - np.float32(shift), axis=-1)
    assert np.median(error) < (0.15 if preset == "medium" else 0.4)


def test_the_same_images_give_the_same_flow_to_the_bit() -> None:
    method, images = DisFlow(), (shifted(0, 0), shifted(1.1, 0.4))
    first = method(*images)
    method(shifted(3.0, 0.0), shifted(0, 0))
    np.testing.assert_array_equal(method(*images), first)
    np.testing.assert_array_equal(DisFlow()(*images), first)


def test_an_unknown_preset_is_refused_with_the_choices() -> None:
    with pytest.raises(ValueError, match=r"'best'.*ultrafast, fast, medium"):
        DisFlow(DisFlowParameters(preset="best"))
