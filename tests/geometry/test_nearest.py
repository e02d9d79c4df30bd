"""The nearest known pixel, against scipy's exact distance transform."""

import cv2
import numpy as np
import pytest
from scipy.ndimage import distance_transform_edt

from riseg_drake.geometry.nearest import nearest_values


@pytest.mark.parametrize("dtype", [np.uint16, np.intp, np.float64])
def test_every_pixel_of_a_row_has_the_value_of_the_known_one_beside_it(dtype: type) -> None:
    values = np.array([[0, 7, 0, 0, 0, 9]], dtype)
    nearest, distance = nearest_values(values, values > 0)
    np.testing.assert_array_equal(nearest[0, [0, 1, 2, 4, 5]], [7, 7, 7, 9, 9])
    assert nearest.dtype == dtype
    np.testing.assert_allclose(distance, [[1, 0, 1, 2, 1, 0]], atol=0.1)


def test_it_is_the_nearest_one_as_far_as_opencv_measures() -> None:
    rng = np.random.default_rng(0)
    known = rng.uniform(size=(60, 80)) < 0.02
    values = np.arange(known.size).reshape(known.shape)
    nearest, distance = nearest_values(values, known, cv2.DIST_MASK_5)
    exact = distance_transform_edt(~known)
    v, u = np.divmod(nearest, known.shape[1])
    assert known[v, u].all()
    rows, columns = np.indices(known.shape)
    # Its mask of 5 x 5 is exact within 2 %.
    np.testing.assert_array_less(np.hypot(v - rows, u - columns), 1.05 * exact + 1e-6)
    np.testing.assert_allclose(distance, exact, rtol=0.03, atol=1e-3)
