import cv2
import numpy as np
import pytest

from riseg_drake.evaluation.label_folders import LabelFolderError, read_labels, score_folders


@pytest.fixture
def folders(tmp_path):
    predicted, true = tmp_path / "predicted", tmp_path / "true"
    predicted.mkdir()
    true.mkdir()
    return predicted, true


def write(path, labels):
    assert cv2.imwrite(str(path), labels)


def test_images_of_equal_names_are_compared(folders):
    predicted, true = folders
    labels = np.zeros((20, 30), np.uint16)
    labels[5:10, 5:10] = 300
    for folder in folders:
        write(folder / "b.png", labels)
    write(predicted / "a.png", np.zeros((20, 30), np.uint8))
    write(true / "a.png", labels)
    scores = dict(score_folders(predicted, true))
    assert list(scores) == ["a.png", "b.png"]
    assert scores["a.png"].overlap_recall == 0
    assert scores["b.png"].overlap_f == 1


def test_sixteen_bit_ids_are_read_as_they_are(tmp_path):
    labels = np.array([[0, 1, 256, 65535]], np.uint16)
    write(tmp_path / "x.png", labels)
    np.testing.assert_array_equal(read_labels(tmp_path / "x.png"), labels)


def make_missing(predicted, true):
    predicted.rmdir()


def make_empty(predicted, true):
    write(predicted / "a.png", np.zeros((4, 4), np.uint8))


def make_unequal_names(predicted, true):
    write(predicted / "a.png", np.zeros((4, 4), np.uint8))
    write(true / "b.png", np.zeros((4, 4), np.uint8))


def make_unequal_sizes(predicted, true):
    write(predicted / "a.png", np.zeros((4, 4), np.uint8))
    write(true / "a.png", np.zeros((4, 5), np.uint8))


def make_colour(predicted, true):
    write(predicted / "a.png", np.zeros((4, 4, 3), np.uint8))
    write(true / "a.png", np.zeros((4, 4), np.uint8))


def make_damaged(predicted, true):
    (predicted / "a.png").write_bytes(b"not a PNG")
    write(true / "a.png", np.zeros((4, 4), np.uint8))


@pytest.mark.parametrize(
    ("spoil", "message"),
    [
        (make_missing, "not a folder"),
        (make_empty, "holds no PNG"),
        (make_unequal_names, "lacks b.png"),
        (make_unequal_sizes, "4x4 .* 5x4"),
        (make_colour, "colour image"),
        (make_damaged, "not a readable PNG"),
    ],
)
def test_bad_folders_are_named_in_one_line(folders, spoil, message):
    predicted, true = folders
    spoil(predicted, true)
    with pytest.raises(LabelFolderError, match=message) as error:
        list(score_folders(predicted, true))
    assert "\n" not in str(error.value)
