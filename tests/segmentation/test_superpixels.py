"""Pieces of a masked image, on images drawn by hand."""

import numpy as np
import pytest

from riseg_drake.segmentation.superpixels import Superpixels, superpixels, with_gaps, with_pieces
from tests.segmentation.drawn_scene import Texture

HEIGHT, WIDTH = 60, 80


def flat(shape: tuple[int, int] = (HEIGHT, WIDTH), gray: int = 120) -> np.ndarray:
    return np.full((*shape, 3), gray, np.uint8)


def cut(color: np.ndarray, mask: np.ndarray, size: int = 10, height: np.ndarray | None = None) -> Superpixels:
    height = np.zeros(mask.shape, np.float32) if height is None else height
    return superpixels(color, height, mask, size)


def blob() -> np.ndarray:
    """A mask with a hole, a part at the image's border, and a few lone pixels."""
    v, u = np.mgrid[:HEIGHT, :WIDTH]
    mask = np.hypot(v - 28, u - 40) < 25
    mask &= np.hypot(v - 28, u - 36) > 6
    mask[40:, :12] = True
    mask[3, 3] = mask[10, 70] = mask[50:52, 75] = True
    return mask


def textured() -> np.ndarray:
    v, u = np.mgrid[:HEIGHT, :WIDTH]
    points = np.stack([u, v, 0 * u], axis=-1).reshape(-1, 3) * 0.001
    return np.clip(Texture(0).color(points), 0, 255).reshape(HEIGHT, WIDTH, 3).astype(np.uint8)


def test_a_body_that_is_seen_in_pieces_stays_one_by_their_nearest_superpixels() -> None:
    """Five strips: two of the body 1, one of the body 2, one of 1 again, and what is no body."""
    label = np.repeat(np.arange(5), [20, 10, 10, 5, 10])[None].repeat(8, axis=0)
    none = np.zeros(4, bool)
    row = Superpixels(label, 5, np.array([[0, 1], [1, 2], [2, 3], [3, 4]]), np.full(4, 8.0), none, none)
    bodies = np.array([1, 1, 2, 1, 0])[label]
    whole = with_pieces(row, bodies)
    np.testing.assert_array_equal(whole.borders, [[0, 1], [1, 2], [1, 3], [2, 3], [3, 4]])
    np.testing.assert_array_equal(whole.behind, np.arange(5) == 2)
    # As strong as the smaller piece is wide, sqrt(5 x 8).
    np.testing.assert_allclose(whole.length, [8, 8, 40**0.5, 8, 8])
    assert not whole.across.any()
    # What touches is in one piece, and of what is no body nothing is known.
    for one in (np.array([1, 1, 1, 1, 2]), np.array([0, 0, 2, 0, 0])):
        np.testing.assert_array_equal(with_pieces(row, one[label]).borders, row.borders)


@pytest.mark.parametrize("size", [3, 6, 15])
@pytest.mark.parametrize("color", [flat(), textured()], ids=["blank", "textured"])
def test_no_piece_lies_outside_the_mask_and_none_is_empty(color: np.ndarray, size: int) -> None:
    pieces = cut(color, blob(), size)
    assert (pieces.label[~blob()] == -1).all()
    np.testing.assert_array_equal(np.unique(pieces.label[pieces.label >= 0]), np.arange(pieces.count))


def test_a_mask_that_fills_the_image_is_covered_to_its_last_pixel() -> None:
    assert (cut(textured(), np.ones((HEIGHT, WIDTH), bool)).label >= 0).all()


def test_pieces_have_about_the_size_asked() -> None:
    pieces = cut(flat(), np.ones((HEIGHT, WIDTH), bool), 10)
    area = np.bincount(pieces.label.ravel())
    assert pieces.count == HEIGHT * WIDTH // 100
    assert np.median(area) == pytest.approx(100, rel=0.3)


@pytest.mark.parametrize("which", ["colour", "height"])
def test_no_piece_crosses_a_strong_edge(which: str) -> None:
    v, u = np.mgrid[:HEIGHT, :WIDTH]
    beyond = u - 40 > 4 * np.sin(v / 6)
    color, height = flat(), np.zeros((HEIGHT, WIDTH), np.float32)
    if which == "colour":
        color[beyond] = [160, 60, 60]
    else:
        height[beyond] = 0.03
    pieces = cut(color, np.ones((HEIGHT, WIDTH), bool), 10, height)
    across = np.minimum(
        np.bincount(pieces.label.ravel(), beyond.ravel()), np.bincount(pieces.label.ravel(), ~beyond.ravel())
    )
    # An edge is found to within a pixel, along a piece's length.
    assert across.max() <= 15
    assert across.sum() < 0.02 * beyond.size


def counted_borders(label: np.ndarray) -> dict[tuple[int, int], int]:
    """Pairs of neighbouring pixels with different labels, one by one."""
    borders: dict[tuple[int, int], int] = {}
    for v in range(label.shape[0]):
        for u in range(label.shape[1]):
            for a, b in ((v + 1, u), (v, u + 1)):
                if a < label.shape[0] and b < label.shape[1] and label[v, u] != label[a, b]:
                    pair = tuple(sorted((int(label[v, u]), int(label[a, b]))))
                    if pair[0] >= 0:
                        borders[pair] = borders.get(pair, 0) + 1
    return borders


def test_borders_are_as_long_as_counted_pixel_by_pixel() -> None:
    pieces = cut(textured(), blob(), 8)
    found = {(int(a), int(b)): int(n) for (a, b), n in zip(pieces.borders, pieces.length, strict=True)}
    assert len(found) == len(pieces.borders)
    assert found == counted_borders(pieces.label)


def test_two_halves_share_one_border_of_the_images_height() -> None:
    color = flat((20, 40))
    color[:, 20:] = 200
    pieces = cut(color, np.ones((20, 40), bool), 20)
    np.testing.assert_array_equal(pieces.borders, [[0, 1]])
    assert pieces.length[0] == pytest.approx(20, abs=2)


@pytest.mark.parametrize(("gap", "widest", "known"), [(10, 10.5, True), (10, 9.5, False), (4, 10.5, True)])
def test_what_is_seen_in_pieces_has_a_border_across_a_gap_no_wider_than_asked(gap, widest, known) -> None:
    label = np.full((40, 60), -1)
    label[:, 10:20], label[:, 20 + gap : 40] = 0, 1
    apart = Superpixels(label, 2, np.zeros((0, 2), int), np.zeros(0), *np.zeros((2, 0), bool))
    joined = with_gaps(apart, widest)
    np.testing.assert_array_equal(joined.borders, np.tile([0, 1], (known, 1)))
    np.testing.assert_array_equal(joined.length, [40] * known)
    np.testing.assert_array_equal(joined.across, [True] * known)
    assert not joined.behind.any()


def test_two_arms_of_one_piece_have_no_border_across_the_gap_between_them() -> None:
    label = np.full((40, 60), -1)
    label[:, 10:20], label[:, 25:35], label[30:, 20:25] = 0, 1, 2
    horseshoe = Superpixels(label, 3, np.array([[0, 2], [1, 2]]), np.full(2, 10.0), *np.zeros((2, 2), bool))
    assert not with_gaps(horseshoe, 20.0).across.any()


@pytest.mark.parametrize("size", [3, 6, 15])
@pytest.mark.parametrize("color", [flat(), textured()], ids=["blank", "textured"])
def test_the_pieces_cover_the_mask_and_nothing_else(color: np.ndarray, size: int) -> None:
    mask = blob()
    pieces = cut(color, mask, size)
    np.testing.assert_array_equal(pieces.label >= 0, mask)
    assert pieces.label.max() < pieces.count
