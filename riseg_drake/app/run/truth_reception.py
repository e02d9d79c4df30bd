"""What an emulator says of the truth, for scores; the diagram of a real robot never sees it."""

from collections import OrderedDict
from collections.abc import Callable

from drake import lcmt_image_array, lcmt_viewer_draw
from pydrake.lcm import DrakeLcmInterface
from pydrake.systems.framework import Context

from riseg_drake.app.run.interactions import Truth
from riseg_drake.geometry.rgbd import Frame
from riseg_drake.stations.arm_messages import array_time
from riseg_drake.stations.ground_truth import LABEL_CHANNEL, POSE_CHANNEL, decode_labels, decode_poses

KEPT = 60
"""Messages kept of each channel: those of some seconds."""


class TruthReception:
    """Listens on the emulator's own channels, and answers as a TruthSource.

    `first_column` is where the part of the pictures begins that is used, px; `offset` tells by how much the
    stamps of frames differ from those of the emulator, s: that of a Reception of a replayed log.
    """

    def __init__(
        self, lcm: DrakeLcmInterface, first_column: int = 0, offset: Callable[[], float] = lambda: 0.0
    ):
        self._first_column, self._offset = first_column, offset
        self._labels: OrderedDict[int, bytes] = OrderedDict()
        self._poses: OrderedDict[int, lcmt_viewer_draw] = OrderedDict()
        lcm.Subscribe(LABEL_CHANNEL, self._take_labels)
        lcm.Subscribe(POSE_CHANNEL, self._take_poses)

    def __call__(self, frame: Frame, context: Context | None = None) -> Truth | None:
        """The truth behind a frame, by its stamp in milliseconds; None where it has not come."""
        stamp = round(1e3 * (frame.time - self._offset()))
        labels, poses = self._labels.get(stamp), self._poses.get(stamp)
        if labels is None or poses is None:
            return None
        true_poses = decode_poses(poses)
        columns = slice(self._first_column, self._first_column + frame.color.shape[1])
        return Truth(
            draw=lambda: decode_labels(lcmt_image_array.decode(labels)).labels[:, columns],
            poses={true_poses.names[i]: X_WBcm for i, X_WBcm in true_poses.X_WBcm.items()},
            names=true_poses.names,
            axes={true_poses.names[i]: axes for i, axes in true_poses.axes.items()},
        )

    def _take_labels(self, data: bytes) -> None:  # LCM calls this from C: nothing may be raised
        if len(data) > 24:
            self._labels[round(1e3 * array_time(data))] = data
            while len(self._labels) > KEPT:
                self._labels.popitem(last=False)

    def _take_poses(self, data: bytes) -> None:
        try:
            message = lcmt_viewer_draw.decode(data)
        except Exception:  # whatever the decoder makes of it
            return
        self._poses[message.timestamp] = message
        while len(self._poses) > KEPT:
            self._poses.popitem(last=False)
