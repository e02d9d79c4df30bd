"""Lists with time stamps: what is a row, which rows belong to a moment, and what is out of order."""

import numpy as np
import pytest

from riseg_drake.recording.layout import RecordingError
from riseg_drake.recording.stamped_lists import StampedTable, nearest_time, read_file_list, read_table


@pytest.fixture
def file(tmp_path):
    """Writes a text, one line a line, and says where."""

    def write(*lines):
        path = tmp_path / "list.txt"
        path.write_text("".join(f"{line}\n" for line in lines))
        return path

    return write


def table_at(tmp_path, *times):
    """A table of which only the stamps matter."""
    number = len(times)
    return StampedTable(tmp_path, [], np.array(times, float), np.zeros((number, 1)), np.arange(number))


def left_out_of(left_out):
    return [(each.line, each.why) for each in left_out]


def test_images_are_listed_with_the_lines_where_they_stand(file):
    entries, left_out = read_file_list(file("# timestamp file", "", "0.5 rgb/a.png", "  0.75\trgb/b.png "))
    assert [(entry.line, entry.time, entry.name) for entry in entries] == [
        (3, 0.5, "rgb/a.png"),
        (4, 0.75, "rgb/b.png"),
    ]
    assert left_out == []


@pytest.mark.parametrize("line", ["0.5"])
def test_an_image_has_one_stamp_and_one_name(file, line):
    with pytest.raises(RecordingError, match=r"list\.txt: line 2 must be: timestamp file"):
        read_file_list(file("0.1 rgb/0.png", line))


def test_a_list_without_an_image_is_none(file):
    with pytest.raises(RecordingError, match="names no image"):
        read_file_list(file("# timestamp file", ""))


@pytest.mark.parametrize("cell", ["noon", "nan", "inf", "1e15", "-1e15"])
def test_what_is_no_number_of_seconds_is_refused_by_its_line(file, cell):
    with pytest.raises(RecordingError, match=f"line 2 holds '{cell}' where a number should be"):
        read_file_list(file("0.1 rgb/0.png", f"{cell} rgb/a.png"))


def test_seconds_since_the_epoch_and_before_it_are_numbers(file):
    entries, _ = read_file_list(file("-9.9e14 a.png", "1305031102.175304 b.png", "9.9e14 c.png"))
    assert [entry.time for entry in entries] == [-9.9e14, 1305031102.175304, 9.9e14]


@pytest.mark.parametrize("lines", [("0.0 a.png", "0.1 b.png"), ("0.1 b.png", "0.0 a.png")])
def test_a_list_of_two_must_rise(file, lines):
    path = file("# heading", *lines)
    if lines[0] < lines[1]:
        assert len(read_file_list(path)[0]) == 2
    else:
        with pytest.raises(RecordingError, match=r"line 3: time runs backwards from 0\.1 to 0\.0 s"):
            read_file_list(path)


def stepping_back(number):
    """Lines whose stamps rise, but for the sixth, which is from before the fourth."""
    return [f"{0.25 if k == 5 else k / 10} {k}.png" for k in range(number)]


def test_one_stamp_in_twenty_may_run_backwards_and_is_left_out(file):
    entries, left_out = read_file_list(file(*stepping_back(20)))
    assert [entry.name for entry in entries] == [f"{k}.png" for k in range(20) if k != 5]
    assert left_out_of(left_out) == [(6, "its time runs backwards")]
    assert left_out[0].file.endswith("list.txt")


def test_one_in_nineteen_is_too_many(file):
    with pytest.raises(RecordingError, match=r"line 6: time runs backwards from 0\.4 to 0\.25 s; stamps must"):
        read_file_list(file(*stepping_back(19)))


def test_what_is_not_newer_than_all_before_is_left_out_not_only_than_the_line_before(file):
    stamps = [k / 10 for k in range(45)]
    stamps[5:7] = [0.25, 0.35]  # the second is newer than the first, and still old
    entries, left_out = read_file_list(file(*(f"{t} {k}.png" for k, t in enumerate(stamps))))
    assert [entry.name for entry in entries] == [f"{k}.png" for k in range(45) if k not in (5, 6)]
    assert left_out_of(left_out) == [(6, "its time runs backwards"), (7, "its time runs backwards")]


def test_a_stamp_that_was_there_is_left_out_however_often_it_comes(file):
    entries, left_out = read_file_list(file("0.0 a.png", "0.1 b.png", "0.1 c.png", "0.1 d.png", "0.2 e.png"))
    assert [entry.name for entry in entries] == ["a.png", "b.png", "e.png"]
    assert left_out_of(left_out) == [(3, "its stamp was there before"), (4, "its stamp was there before")]


def test_two_equal_stamps_are_one_image_and_three_are_no_clock(file):
    entries, left_out = read_file_list(file("# heading", "0.1 a.png", "0.1 b.png"))
    assert [entry.name for entry in entries] == ["a.png"]
    assert left_out_of(left_out) == [(3, "its stamp was there before")]
    with pytest.raises(RecordingError, match="line 3: all stamps are equal"):
        read_file_list(file("# heading", "0.1 a.png", "0.1 b.png", "0.1 c.png"))


def test_a_table_holds_numbers_by_stamp_and_the_rows_left_out(file):
    table, left_out = read_table(file("# x", "0.5, 1, 2", "", "0.5, 3, 4", "0.75, 5, 6"), None, ",")
    np.testing.assert_array_equal(table.times, [0.5, 0.75])
    np.testing.assert_array_equal(table.values, [[1, 2], [5, 6]])
    np.testing.assert_array_equal(table.lines, [2, 5])
    assert table.names == []
    assert left_out_of(left_out) == [(4, "its stamp was there before")]


def test_a_table_that_is_not_there_is_none(tmp_path):
    assert read_table(tmp_path / "joints.csv", None) is None


@pytest.mark.parametrize(
    ("columns", "lines", "says"),
    [
        (None, ("1 2 3", "2 3"), "line 2 must hold 3 numbers, it holds 2"),
        (None, ("1", "2"), "line 1 must hold 2 numbers, it holds 1"),
        (4, ("1 2 3",), "line 1 must hold 4 numbers, it holds 3"),
        (2, ("# nothing",), "it holds no numbers"),
        (2, ("1 2", "2 1e15"), "line 2 holds '1e15' where a number should be"),
    ],
)
def test_a_table_has_as_many_numbers_in_every_row(file, columns, lines, says):
    with pytest.raises(RecordingError, match=says):
        read_table(file(*lines), columns)


def test_a_table_of_single_numbers_is_one(file):
    table, _ = read_table(file("0 7", "1 8"), None)
    np.testing.assert_array_equal(table.values, [[7], [8]])


HEADING = "timestamp, q1 ,q2"


@pytest.mark.parametrize(
    ("lines", "names"),
    [
        ((HEADING, "0,1,2"), ["q1", "q2"]),
        (("# of a robot", "", "  ", HEADING, "0,1,2"), ["q1", "q2"]),
        (("0,1,2", HEADING), []),
        (("# timestamp,a,b", "0,1,2"), []),
        (("0,1,2",), []),
    ],
    ids=["the first line", "after comments and empty lines", "after numbers", "a comment", "none"],
)
def test_the_columns_names_are_those_of_the_line_before_the_numbers(file, lines, names):
    table, _ = read_table(file(*lines), None, ",")
    assert table.names == names
    np.testing.assert_array_equal(table.values, [[1, 2]])


LIMIT = 0.25


@pytest.mark.parametrize(
    ("time", "belongs"),
    [
        (1.0, (0, 0, 0.0)),  # a row's own moment
        (1.125, (0, 1, 0.25)),
        (1.375, (0, 1, 0.75)),
        (1.5, (1, 1, 0.0)),
        (1.75, (1, 2, 0.2)),  # 1.25 s, five limits, lie between these two
        (2.5, (1, 2, 0.8)),
        (2.0, None),  # more than a limit from both
        (3.0, (2, 2, 0.0)),  # six limits lie after this row
        (4.25, (3, 3, 0.0)),
        (2.75, (2, 2, 0.0)),
        (0.75, (0, 0, 0.0)),  # before the first
        (0.74, None),
        (4.75, (3, 3, 0.0)),  # after the last
        (4.76, None),
    ],
)
def test_a_moment_belongs_between_two_rows_that_are_near_each_other_and_to_one_elsewhere(
    tmp_path, time, belongs
):
    bracket = table_at(tmp_path, 1.0, 1.5, 2.75, 4.5).bracket(time, LIMIT)
    assert bracket == (belongs and (*belongs[:2], pytest.approx(belongs[2])))


def test_with_a_single_row_there_is_nothing_between(tmp_path):
    table = table_at(tmp_path, 1.0)
    assert table.bracket(1.125, LIMIT) == table.bracket(0.875, LIMIT) == (0, 0, 0.0)
    assert table.bracket(1.5, LIMIT) is None


@pytest.mark.parametrize(
    ("time", "nearest"), [(-9.0, 0), (0.0, 0), (0.4, 0), (0.6, 1), (1.0, 1), (1.9, 1), (2.1, 2), (9.0, 2)]
)
def test_the_nearest_time_is_the_one_least_apart(time, nearest):
    assert nearest_time(np.array([0.0, 1.0, 3.0]), time) == nearest


def test_a_name_may_hold_spaces(file):
    ((entry,), _) = read_file_list(file("0.5  rgb/my first image.png  \n"))
    assert (entry.time, entry.name) == (0.5, "rgb/my first image.png")


def test_a_row_that_nobody_knew_is_left_out_and_the_others_stay(file):
    """Trackers that have lost their way write nan; a whole recording shall not be lost with it."""
    path = file("0.0 1 2", "0.1 nan nan", "0.2 3 -NaN", "0.3 5 6")
    table, left_out = read_table(path, 3)
    np.testing.assert_array_equal(table.times, [0.0, 0.3])
    np.testing.assert_array_equal(table.values, [[1, 2], [5, 6]])
    assert [(line.line, line.why.split(":")[0]) for line in left_out] == [
        (2, "it holds nan"),
        (3, "it holds nan"),
    ]


def test_a_table_of_nothing_known_is_none(file):
    with pytest.raises(RecordingError, match="line 1 holds 'nan' where a number should be"):
        read_table(file("0.0 nan", "0.1 nan"), 2)


@pytest.mark.parametrize(
    ("stamp", "unit", "divisor"),
    [("1305031102175304000", "nanoseconds", "1e9"), ("1305031102175304", "microseconds", "1e6")],
)
def test_stamps_that_count_since_1970_in_other_units_are_called_so(file, stamp, unit, divisor):
    with pytest.raises(
        RecordingError, match=f"line 1 holds {stamp}, which looks like {unit}.*divide by {divisor}"
    ):
        read_file_list(file(f"{stamp} a.png"))
