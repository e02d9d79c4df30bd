"""What only an emulator can know, on LCM channels of its own: true labels and poses, to score masks by.

Nothing that a real robot runs listens to these channels.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from drake import lcmt_image, lcmt_image_array, lcmt_viewer_draw
from numpy.typing import NDArray
from pydrake.common.eigen_geometry import Quaternion
from pydrake.math import RigidTransform

from riseg_drake.stations.lcm_images import ImageError, decode_image, encode_image

LABEL_CHANNEL = "RISEG_GROUND_TRUTH_LABELS"
"""lcmt_image_array with one image, `label`, of every picture that was taken while the arm stood still."""
POSE_CHANNEL = "RISEG_GROUND_TRUTH_POSES"
"""lcmt_viewer_draw with the objects' poses in W at every picture, `robot_num` being the object id.

A pose is that of the body's axes in its centre of mass. For every axis about which an object is a body of
revolution there is one link more, named `axis`, whose position is the unit vector, in the body's axes.
"""
_AXIS = "axis"


@dataclass(frozen=True)
class TrueLabels:
    """The true visible object ids behind one picture."""

    time: float
    """Of the picture, s: equal to the picture's own stamp."""
    labels: NDArray[np.uint16]
    """[H, W], object ids 1..N, 0 = table, robot, nothing."""


@dataclass(frozen=True)
class TruePoses:
    """Where the objects were when one picture was taken."""

    time: float
    """Of the picture, s: equal to the picture's own stamp."""
    names: Mapping[int, str]
    """By object id."""
    X_WBcm: Mapping[int, NDArray[np.float64]]
    """By object id, [4, 4], B's axes in the centre of mass; good to a micrometre: the message has 32 bits."""
    axes: Mapping[int, NDArray[np.float64]]
    """By object id, unit vectors in B [k, 3] about which it is a body of revolution."""


def encode_labels(labels: NDArray[np.uint16], stamp_ms: int, sequence: int) -> lcmt_image_array:
    """The message for labels [H, W] of the picture stamped `stamp_ms`."""
    message = lcmt_image_array()
    message.header.seq = sequence
    message.header.utime = 1000 * stamp_ms
    message.images = [encode_image("label", labels, stamp_ms, lcmt_image.COMPRESSION_METHOD_PNG)]
    message.num_images = 1
    return message


def decode_labels(message: lcmt_image_array) -> TrueLabels:
    """Labels out of a message. Raises ImageError for a message of another kind."""
    images = {image.header.frame_name: image for image in message.images}
    if "label" not in images:
        raise ImageError(f"no labels: frames are {', '.join(map(repr, images)) or 'none'}; expected 'label'")
    image = images["label"]
    return TrueLabels(image.header.utime / 1e3, decode_image(image).astype(np.uint16))


def encode_poses(
    names: Mapping[int, str],
    X_WBcm: Mapping[int, RigidTransform],
    axes: Mapping[int, NDArray[np.float64]],
    stamp_ms: int,
) -> lcmt_viewer_draw:
    """The message for what TruePoses holds, of the picture stamped `stamp_ms`; all by object id."""
    round_about = [(object_id, axis) for object_id in axes for axis in axes[object_id]]
    message = lcmt_viewer_draw()
    message.timestamp = stamp_ms
    message.num_links = len(names) + len(round_about)
    message.link_name = [*names.values(), *(_AXIS for _ in round_about)]
    message.robot_num = [*names, *(object_id for object_id, _ in round_about)]
    message.position = [X_WBcm[object_id].translation().tolist() for object_id in names]
    message.position += [axis.tolist() for _, axis in round_about]
    message.quaternion = [X_WBcm[object_id].rotation().ToQuaternion().wxyz().tolist() for object_id in names]
    message.quaternion += [[1.0, 0.0, 0.0, 0.0] for _ in round_about]
    return message


def decode_poses(message: lcmt_viewer_draw) -> TruePoses:
    """Poses out of a message."""
    names: dict[int, str] = {}
    poses: dict[int, NDArray] = {}
    axes: dict[int, list] = {}
    for object_id, name, position, wxyz in zip(
        message.robot_num, message.link_name, message.position, message.quaternion, strict=True
    ):
        if object_id in names:  # said before: this link is an axis
            axes[object_id].append(position)
            continue
        unit = np.array(wxyz) / np.linalg.norm(wxyz)  # 32 bits left it a little off
        names[object_id], axes[object_id] = name, []
        poses[object_id] = RigidTransform(Quaternion(unit), position).GetAsMatrix4()
    shaped = {object_id: np.array(each, float).reshape(-1, 3) for object_id, each in axes.items()}
    return TruePoses(message.timestamp / 1e3, names, poses, shaped)
