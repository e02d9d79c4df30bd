"""Video that every browser plays: H.264 in MP4, by FFmpeg's own encoder.

The library is PyAV, whose wheels hold FFmpeg with x264 (40 MB); imageio-ffmpeg would bring the whole program
(68 MB), to be spoken to through pipes. OpenCV's wheels write MPEG-4 part 2 only, which browsers do not play.
"""

from collections.abc import Iterator
from contextlib import contextmanager
from fractions import Fraction
from pathlib import Path
from typing import cast

import av
import cv2
import numpy as np
from av.video.reformatter import ColorRange, Colorspace
from av.video.stream import VideoStream
from numpy.typing import NDArray

_QUALITY = "20"
"""Constant rate factor: 0 loses nothing, 23 is usual, and 51 the worst."""
_SPEED = "veryfast"
"""A tenth of the time that `medium` takes, at a fifth more bytes."""
_BAR = 4
"""Height of the bar of time, pixels; twice that from a width of `_WIDE` pixels on."""
_WIDE = 1200
_TRACK, _PASSED, _INK = (60, 60, 60), (230, 159, 0), (255, 255, 255)


def with_time(picture: NDArray[np.uint8], time: float, share: float) -> NDArray[np.uint8]:
    """The picture [H, W, 3] with the time, s, in its lower left corner, and a bar filled to a share."""
    shown = picture.copy()
    height, width = shown.shape[:2]
    thick = 2 if width >= _WIDE else 1
    top = height - _BAR * thick
    shown[top:] = _TRACK
    shown[top:, : round(width * min(max(share, 0.0), 1.0))] = _PASSED
    place, font, scale = (4 * thick, top - 5 * thick), cv2.FONT_HERSHEY_SIMPLEX, 0.42 * thick
    for ink, line in (((0, 0, 0), 3 * thick), (_INK, thick)):
        cv2.putText(shown, f"{time:.2f} s", place, font, scale, ink, line, cv2.LINE_AA)
    return shown


class VideoWriter:
    """Writes pictures of one size into an MP4 file of `rate` pictures a second, as they come.

    Sides of an odd number of pixels get one more, a copy of the last: the codec halves the colours. Raises
    OSError where the file cannot be written.
    """

    def __init__(self, path: Path, rate: float, shape: tuple[int, int]):
        """For pictures of shape (H, W)."""
        self._path, self._shape = path, shape
        with self._naming():
            self._file = av.open(str(path), "w", format="mp4")
        # A thread of its own for each core would take them from the segmentation.
        options = {"crf": _QUALITY, "preset": _SPEED, "threads": "1"}
        rate_exactly = Fraction(rate).limit_denominator(1000)
        self._stream = cast(VideoStream, self._file.add_stream("libx264", rate_exactly, options=options))
        self._stream.height, self._stream.width = (side + side % 2 for side in shape)
        self._stream.pix_fmt = "yuv420p"  # what all browsers decode
        # Which matrix the colours go through: the one of players who do not look, and said to those who do.
        self._stream.codec_context.colorspace = Colorspace.ITU601
        self._stream.codec_context.color_range = ColorRange.MPEG
        with self._naming():
            self._file.start_encoding()

    def append(self, picture: NDArray[np.uint8]) -> None:
        """Write one picture [H, W, 3], RGB."""
        height, width = self._shape
        even = np.pad(picture, ((0, height % 2), (0, width % 2), (0, 0)), mode="edge")
        frame = av.VideoFrame.from_ndarray(np.ascontiguousarray(even), format="rgb24")
        frame = frame.reformat(
            format="yuv420p", dst_colorspace=Colorspace.ITU601, dst_color_range=ColorRange.MPEG
        )
        with self._naming():
            self._file.mux(self._stream.encode(frame))

    def close(self) -> None:
        """Write what waits in the encoder, and the index, and close the file."""
        with self._naming():
            try:
                self._file.mux(self._stream.encode())
            finally:
                self._file.close()

    @contextmanager
    def _naming(self) -> Iterator[None]:
        """Errors of FFmpeg's are OSErrors that name the file."""
        try:
            yield
        except av.FFmpegError as error:
            raise OSError(error.errno, error.strerror, str(self._path)) from None
