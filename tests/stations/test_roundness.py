import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from riseg_drake.stations.object_models import find_models
from riseg_drake.stations.roundness import axes_of_revolution

ASKEW = Rotation.from_euler("xyz", [0.4, -1.0, 2.0]).as_matrix()
CANDIDATES = np.vstack([np.eye(3), ASKEW.T])


def ring(radius, z, sides=48, phase=0.0):
    angle = phase + np.linspace(0, 2 * np.pi, sides, endpoint=False)
    return np.column_stack([radius * np.cos(angle), radius * np.sin(angle), np.full(sides, z)])


def prism(sides):
    return np.vstack([ring(0.03, -0.05, sides), ring(0.03, 0.06, sides)])


def ball(radius=0.03):
    return np.vstack([ring(radius * np.sin(t), radius * np.cos(t)) for t in np.linspace(0, np.pi, 25)])


@pytest.mark.parametrize(
    ("points", "number"),
    [
        (prism(48), 1),
        (prism(8), 1),
        (prism(6), 0),
        (prism(4), 0),
        (np.vstack([ring(0.03, 0.0), ring(0.01, 0.12)]), 1),
        (np.vstack([ring(0.03, 0.0), ring(0.03, 0.08), [[0.045, 0.0, 0.04]]]), 0),
        (np.vstack([ring(0.03, 0.0), ring(0.03, 0.08, 4)]), 0),
        (ring(0.03, 0.0) * (1.0, 0.7, 1.0) + (0.0, 0.0, 0.02), 0),
        (ring(0.03, 0.03 / np.sqrt(2), 4, np.pi / 4) * np.array([[[1, 1, 1]], [[1, 1, -1]]]), 0),
        (ball(), 3),
        (np.add(ball(), (0.0, 0.0, 0.006)), 1),
    ],
    ids=[
        "can",
        "octagon",
        "hexagon",
        "square",
        "cone",
        "mug",
        "round below, square above",
        "oval",
        "cube",
        "ball",
        "ball with its weight below",
    ],
)
@pytest.mark.parametrize("R", [np.eye(3), ASKEW], ids=["along", "askew"])
def test_axes_are_those_about_which_a_thing_is_equally_wide_on_all_sides(points, number, R):
    axes = axes_of_revolution(points.reshape(-1, 3) @ R.T, CANDIDATES)
    assert axes.shape == (number, 3)
    if number == 1:
        np.testing.assert_allclose(axes[0], R[:, 2])
    for k, axis in enumerate(axes):
        assert not any(abs(axis @ other) > 0.99 for other in axes[:k])


def test_cans_and_bottles_roll_and_boxes_mugs_and_oval_bottles_do_not():
    folders = [f"package://riseg_drake_models/{name}" for name in ("household", "objects")]
    models = {model.name: model for model in find_models(folders)}
    round_ones = {name for name, model in models.items() if len(model.axes)}
    assert round_ones == {
        *(f"can_{name}" for name in ("beans", "black", "soda_lying", "steel", "tomatoes", "tuna")),
        *(f"bottle_{name}" for name in ("sauce_lying", "vitamins", "water_lying", "white")),
        *(f"bowl_{name}" for name in ("blue", "white", "wood")),
        *("cup_red", "coaster_cork", "plate_rings", "cookie", "doughnut", "orange"),
    }
    for name in round_ones:
        np.testing.assert_allclose(np.abs(models[name].axes), [[0.0, 0.0, 1.0]], atol=1e-9)


def test_the_centre_of_mass_is_the_models():
    models = {m.name: m for m in find_models("package://riseg_drake_models/household", ["can_soda_lying"])}
    lying = models["can_soda_lying"]
    np.testing.assert_allclose(lying.centre[:2], 0.0, atol=1e-6)
    assert lying.centre[2] == pytest.approx(0.0551, abs=1e-4)  # along the can, whose origin is its bottom
    assert (lying.X_WB @ lying.centre)[2] == pytest.approx(0.0, abs=1e-6)
