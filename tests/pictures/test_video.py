from fractions import Fraction

import av
import numpy as np
import pytest

from riseg_drake.pictures.video import VideoWriter, with_time
from tests.browser import NO_PROGRAM, dumped

RATE = 15.0


def pictures(shape=(61, 83), count=9):
    """A ramp of two colours through which a square moves."""
    height, width = shape
    for k in range(count):
        picture = np.zeros((height, width, 3), np.uint8)
        picture[..., 0] = np.linspace(0, 255, width)
        picture[..., 1] = np.linspace(0, 255, height)[:, None]
        picture[10:30, 10 + 4 * k : 30 + 4 * k] = (0, 158, 115)
        yield picture


def written(path, shape=(61, 83)):
    shown = list(pictures(shape))
    writer = VideoWriter(path, RATE, shape)
    for picture in shown:
        writer.append(picture)
    writer.close()
    return shown


def test_what_was_written_is_read_back_as_h264_of_eight_bits_with_every_frame_and_its_time(tmp_path):
    shown = written(tmp_path / "video.mp4")
    with av.open(str(tmp_path / "video.mp4")) as file:
        (stream,) = file.streams
        assert (stream.codec_context.name, stream.codec_context.pix_fmt) == ("h264", "yuv420p")
        assert (stream.height, stream.width) == (62, 84)  # one more, for the codec wants even sides
        frames = list(file.decode(video=0))
        assert len(frames) == len(shown) == stream.frames
    assert [frame.pts * frame.time_base for frame in frames] == [Fraction(k, 15) for k in range(9)]


def test_its_pixels_are_those_that_were_shown_to_a_few_gray_levels(tmp_path):
    shown = written(tmp_path / "video.mp4")
    with av.open(str(tmp_path / "video.mp4")) as file:
        for frame, picture in zip(file.decode(video=0), shown, strict=True):
            seen = frame.to_ndarray(format="rgb24")
            wrong = np.abs(seen[:61, :83].astype(int) - picture)
            # Colours have half the resolution, so borders between colours are soft.
            assert wrong.mean() < 3
            u = int(np.argmax((picture[20] == (0, 158, 115)).all(axis=-1))) + 10
            np.testing.assert_allclose(seen[15:25, u - 4 : u + 4].mean(axis=(0, 1)), (0, 158, 115), atol=6)


@pytest.mark.skipif(bool(NO_PROGRAM), reason=NO_PROGRAM)
@pytest.mark.renders
def test_a_browser_can_play_it_to_the_end(tmp_path):
    written(tmp_path / "video.mp4", (62, 84))
    (tmp_path / "page.html").write_text(
        '<title>none</title><video muted preload="auto" src="video.mp4" oncanplaythrough="document.title = '
        "[this.readyState, this.videoWidth, this.videoHeight, this.duration.toFixed(3)].join(' ')\"></video>"
    )
    seen, _ = dumped(tmp_path / "page.html", "--virtual-time-budget=10000")
    assert "<title>4 84 62 0.600</title>" in seen  # 4: HAVE_ENOUGH_DATA; nine frames at 15 a second


def test_the_bar_of_time_is_filled_by_the_share_that_has_passed():
    black = np.zeros((48, 64, 3), np.uint8)
    for share, filled in ((0.0, 0), (0.25, 16), (1.0, 64)):
        shown = with_time(black, 1.5, share)
        assert ((shown[-1] == (230, 159, 0)).all(axis=-1)).sum() == filled
        assert (shown[-1, filled:] == 60).all()
        assert shown[20:44].max() > 200  # the time
        assert not shown[:20].any()
    assert not black.any()
    assert (with_time(black, 1.5, 0.5) != with_time(black, 2.5, 0.5)).any()


def test_a_place_where_nothing_can_be_written_is_an_error_of_the_system_that_names_it(tmp_path):
    with pytest.raises(OSError, match="No such file") as error:
        VideoWriter(tmp_path / "nowhere" / "video.mp4", RATE, (62, 84))
    assert error.value.filename == str(tmp_path / "nowhere" / "video.mp4")
