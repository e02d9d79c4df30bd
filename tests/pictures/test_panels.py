import cv2
import numpy as np

from riseg_drake.pictures.panels import image_panels, panels


def test_a_figure_shows_itself_as_a_jpeg():
    figure = image_panels(["a", "b"], [np.zeros((48, 64, 3), np.uint8)] * 2)
    picture = cv2.imdecode(np.frombuffer(figure._repr_jpeg_(), np.uint8), cv2.IMREAD_COLOR)
    assert picture.shape[1] == round(figure.get_figwidth() * figure.dpi)


def test_panels_fill_rows_and_what_is_left_stays_empty():
    figure, axes = panels(["a", "b", "c"], columns=2)
    assert [each.get_title() for each in axes] == ["a", "b", "c"]
    assert len(figure.axes) == 3
    assert len({each.get_subplotspec().rowspan.start for each in axes}) == 2


def test_images_are_shown_whole_and_right_way_up():
    figure = image_panels(["a"], [np.zeros((48, 64, 3), np.uint8)])
    assert figure.axes[0].get_xlim() == (-0.5, 63.5)
    assert figure.axes[0].get_ylim() == (47.5, -0.5)
