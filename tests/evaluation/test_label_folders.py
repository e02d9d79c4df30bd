import cv2
import numpy as np
import pytest
from PIL import Image

from riseg_drake.evaluation.label_folders import (
    LabelConventions,
    LabelFolderError,
    LabelHabits,
    read_labels,
    score_folders,
)


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


@pytest.mark.parametrize(
    ("more", "says"), [(1, "lacks a0.png;"), (2, "lacks a0.png and 1 more;"), (4, "lacks a0.png and 3 more;")]
)
@pytest.mark.parametrize("lacking", [0, 1], ids=["predicted", "true"])
def test_the_folder_that_lacks_images_is_named_with_the_first_and_how_many(folders, more, says, lacking):
    labels = np.zeros((4, 4), np.uint8)
    for folder in folders:
        write(folder / "b.png", labels)
    for k in range(more):
        write(folders[1 - lacking] / f"a{k}.png", labels)
    with pytest.raises(LabelFolderError, match=f"^{folders[lacking]} {says}"):
        list(score_folders(*folders))


def test_names_may_end_in_capitals_and_other_files_are_passed_over(folders):
    for folder in folders:
        write(folder / "a.png", np.ones((4, 4), np.uint8))
        (folder / "a.png").rename(folder / "A.PNG")
        (folder / "notes.txt").write_text("")
    assert [name for name, _ in score_folders(*folders)] == ["A.PNG"]


@pytest.mark.parametrize("kind", [np.uint8, np.uint16])
def test_a_colour_image_is_none_of_labels_in_any_depth(tmp_path, kind):
    write(tmp_path / "x.png", np.zeros((4, 4, 3), kind))
    with pytest.raises(LabelFolderError, match=r"x\.png is a colour image"):
        read_labels(tmp_path / "x.png")


@pytest.mark.parametrize("bits", [1, 2, 4, 8])
def test_the_numbers_of_a_palette_are_the_ids_whatever_their_colours(tmp_path, bits):
    ids = (np.arange(12).reshape(3, 4) % 2**bits).astype(np.uint8)
    image = Image.fromarray(ids).convert("L")
    image.putpalette([7, 7, 7, 200, 0, 0, *[9] * 30])
    image.save(tmp_path / "x.png", bits=bits)
    np.testing.assert_array_equal(read_labels(tmp_path / "x.png"), ids)


def test_names_may_differ_by_an_ending_of_one_folder(folders):
    predicted, true = folders
    for number in range(3):
        write(predicted / f"00{number}_mask.png", np.full((4, 4), number, np.uint8))
        write(true / f"00{number}.png", np.full((4, 4), number, np.uint8))
    for one, other in ((predicted, true), (true, predicted)):
        scores = dict(score_folders(one, other))
        assert list(scores) == sorted(path.name for path in one.iterdir())
        assert all(figures.overlap_f == 1 for figures in scores.values())


def test_what_is_to_be_ignored_counts_neither_way(folders):
    """An object of 4 pixels, 2 of them in the rim, which the prediction has, too: 255 is no object."""
    predicted, true = folders
    labels = np.zeros((6, 6), np.uint8)
    labels[2, 1:3], labels[3, 1:3] = 1, 255
    write(true / "a.png", labels)
    write(predicted / "a.png", np.where(labels > 0, 5, 0).astype(np.uint8))
    assert dict(score_folders(*folders))["a.png"].overlap_f < 1
    scores = dict(score_folders(*folders, LabelConventions(ignore=255)))["a.png"]
    assert (scores.overlap_f, scores.boundary_f) == (1, 1)


def test_another_value_may_be_background_in_one_folder_alone(folders):
    predicted, true = folders
    labels = np.ones((6, 6), np.uint8)
    labels[2:4, 2:4] = 2
    write(true / "a.png", labels)
    write(predicted / "a.png", labels - 1)
    assert dict(score_folders(*folders, LabelConventions(background=1)))["a.png"].overlap_f == 1
    assert (
        dict(score_folders(true, predicted, LabelConventions(predicted_background=1)))["a.png"].overlap_f == 1
    )


def blobs():
    labels = np.zeros((120, 160), np.uint8)
    labels[20:60, 20:60], labels[30:80, 90:130] = 1, 2
    return labels


def habits_of(prediction, truth, **conventions):
    habits = LabelHabits()
    for _ in range(2):
        habits.look(*LabelConventions(**conventions).apply(prediction, truth))
    return habits.doubts()


def test_a_table_that_counts_as_an_object_is_told_with_the_option():
    table = np.where(blobs() > 0, blobs() + 1, 1).astype(np.uint8)
    assert habits_of(blobs(), blobs()) == []
    assert habits_of(table, blobs()) == [
        "1 fills most of every predicted image; if it is the table, give --predicted-background 1"
    ]
    (line,) = habits_of(blobs(), table)
    assert line == "1 fills most of every true image; if it is the table, give --background 1"
    assert habits_of(blobs(), table, background=1) == []


def test_a_rim_of_255_is_told_with_the_option_and_an_object_of_that_id_is_not():
    near = cv2.dilate(blobs(), np.ones((5, 5)))
    rims = np.where((near > 0) & (blobs() == 0), 255, blobs()).astype(np.uint8)
    (line,) = habits_of(blobs(), rims)
    assert line == "255 is a rim in every true image; if it is to be ignored, give --ignore 255"
    assert habits_of(blobs(), rims, ignore=255) == []
    assert habits_of(blobs(), np.where(blobs() == 2, 255, blobs()).astype(np.uint8)) == []


def test_one_image_that_an_object_fills_is_no_habit():
    habits = LabelHabits()
    habits.look(blobs(), blobs())
    habits.look(np.ones((120, 160), np.uint8), np.ones((120, 160), np.uint8))
    assert habits.doubts() == []
