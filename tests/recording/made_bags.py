"""Bags for tests, written by the rosbags library from frames: one RGB-D camera, and what may go with it."""

import struct
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
from rosbags.rosbag1 import Writer as Writer1
from rosbags.rosbag2 import StoragePlugin
from rosbags.rosbag2 import Writer as Writer2
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from riseg_drake.geometry.camera import Intrinsics
from riseg_drake.recording.layout import RecordedFrame, pose_to_numbers

CAMERA = "camera_color_optical_frame"


@dataclass
class BagKind:
    """How a bag is written."""

    ros: int = 2
    storage: str = "sqlite3"
    color: str = "rgb8"
    """An encoding, or "png"."""
    depth: str = "16UC1"
    """An encoding, or "png" and "inverse" for compressedDepth of either."""
    poses: str = "tf"
    """tf, chain, stamped or nothing."""
    chunks: bool = False
    bare: bool = False
    """Whether the path is that of the file in the folder."""


class BagWriter:
    """Messages of any type, in the format of ROS 1 or of ROS 2."""

    def __init__(self, path: Path, kind: BagKind):
        self._ros1 = kind.ros == 1
        self.store = get_typestore(Stores.ROS1_NOETIC if self._ros1 else Stores.ROS2_HUMBLE)
        if self._ros1:
            transforms = "geometry_msgs/TransformStamped[] transforms"
            self.store.register(get_types_from_msg(transforms, "tf2_msgs/msg/TFMessage"))
            self.path = path.with_suffix(".bag")
            self._writer = Writer1(self.path)
            if kind.chunks:
                self._writer.set_compression(Writer1.CompressionFormat.LZ4)
        else:
            plugin = {"sqlite3": StoragePlugin.SQLITE3, "mcap": StoragePlugin.MCAP}[kind.storage]
            self._writer = Writer2(path, version=9, storage_plugin=plugin)
            suffix = {"sqlite3": "db3", "mcap": "mcap"}[kind.storage]
            self.path = path / f"{path.name}.{suffix}" if kind.bare else path
        self._connections = {}

    def __enter__(self):
        self._writer.open()
        return self

    def __exit__(self, *_):
        self._writer.close()

    def make(self, kind, /, **fields):
        return self.store.types[kind](**fields)

    def header(self, ns, frame):
        stamp = self.make("builtin_interfaces/msg/Time", sec=ns // 10**9, nanosec=ns % 10**9)
        more = {"seq": 0} if self._ros1 else {}
        return self.make("std_msgs/msg/Header", stamp=stamp, frame_id=frame, **more)

    def write(self, topic, ns, message):
        kind = message.__msgtype__
        if topic not in self._connections:
            self._connections[topic] = self._writer.add_connection(topic, kind, typestore=self.store)
        serialize = self.store.serialize_ros1 if self._ros1 else self.store.serialize_cdr
        self._writer.write(self._connections[topic], ns, serialize(message, kind))

    def image(self, topic, ns, frame, pixels, encoding):
        height, width = pixels.shape[:2]
        data = np.frombuffer(np.ascontiguousarray(pixels).tobytes(), np.uint8)
        fields = dict(height=height, width=width, encoding=encoding, is_bigendian=0, step=len(data) // height)
        self.write(
            topic, ns, self.make("sensor_msgs/msg/Image", header=self.header(ns, frame), data=data, **fields)
        )

    def compressed(self, topic, ns, frame, content, encoding):
        data = np.frombuffer(content, np.uint8)
        self.write(
            topic,
            ns,
            self.make(
                "sensor_msgs/msg/CompressedImage", header=self.header(ns, frame), format=encoding, data=data
            ),
        )

    def camera_info(self, topic, ns, frame, k: Intrinsics, distortion=(0.0,) * 5):
        K = np.array([k.fx, 0, k.cx, 0, k.fy, k.cy, 0, 0, 1.0])
        P = np.array([k.fx, 0, k.cx, 0, 0, k.fy, k.cy, 0, 0, 0, 1.0, 0])
        roi = self.make(
            "sensor_msgs/msg/RegionOfInterest", x_offset=0, y_offset=0, height=0, width=0, do_rectify=False
        )
        matrices = {"D": np.array(distortion), "K": K, "R": np.eye(3).ravel(), "P": P}
        if not self._ros1:
            matrices = {name.lower(): value for name, value in matrices.items()}
        fields = dict(height=k.height, width=k.width, distortion_model="plumb_bob", binning_x=0, binning_y=0)
        self.write(
            topic,
            ns,
            self.make(
                "sensor_msgs/msg/CameraInfo", header=self.header(ns, frame), roi=roi, **fields, **matrices
            ),
        )

    def transform(self, topic, ns, parent, child, X):
        x, y, z, qx, qy, qz, qw = pose_to_numbers(X)
        transform = self.make(
            "geometry_msgs/msg/Transform",
            translation=self.make("geometry_msgs/msg/Vector3", x=x, y=y, z=z),
            rotation=self.make("geometry_msgs/msg/Quaternion", x=qx, y=qy, z=qz, w=qw),
        )
        stamped = self.make(
            "geometry_msgs/msg/TransformStamped",
            header=self.header(ns, parent),
            child_frame_id=child,
            transform=transform,
        )
        self.write(topic, ns, self.make("tf2_msgs/msg/TFMessage", transforms=[stamped]))

    def pose(self, topic, ns, frame, X):
        x, y, z, qx, qy, qz, qw = pose_to_numbers(X)
        pose = self.make(
            "geometry_msgs/msg/Pose",
            position=self.make("geometry_msgs/msg/Point", x=x, y=y, z=z),
            orientation=self.make("geometry_msgs/msg/Quaternion", x=qx, y=qy, z=qz, w=qw),
        )
        self.write(
            topic, ns, self.make("geometry_msgs/msg/PoseStamped", header=self.header(ns, frame), pose=pose)
        )

    def joints(self, topic, ns, names, q):
        fields = dict(name=list(names), position=np.array(q, float), velocity=np.zeros(0), effort=np.zeros(0))
        self.write(topic, ns, self.make("sensor_msgs/msg/JointState", header=self.header(ns, ""), **fields))


def png(pixels) -> bytes:
    if pixels.ndim == 3:
        pixels = cv2.cvtColor(pixels, cv2.COLOR_RGB2BGR)
    return cv2.imencode(".png", pixels)[1].tobytes()


def write_depth(bag: BagWriter, topic: str, ns: int, frame: str, depth, kind: str) -> None:
    """Depth [H, W], m, as one of the encodings that people record."""
    millimetres = np.rint(depth.astype(float) * 1000).astype(np.uint16)
    if kind == "16UC1":
        bag.image(topic, ns, frame, millimetres, "16UC1")
    elif kind == "32FC1":
        bag.image(topic, ns, frame, np.where(depth > 0, depth, np.float32(np.nan)), "32FC1")
    elif kind == "png":
        content = struct.pack("<iff", 0, 0, 0) + png(millimetres)
        bag.compressed(f"{topic}/compressedDepth", ns, frame, content, "16UC1; compressedDepth png")


def write_bag(path: Path, frames: list[RecordedFrame], k: Intrinsics, kind: BagKind) -> Path:
    """A bag of frames whose depth is aligned to colour; the path to give to riseg."""
    with BagWriter(path, kind) as bag:
        base = "/camera/aligned_depth_to_color/image_raw"
        for number, frame in enumerate(frames):
            ns = round(frame.time * 10**9)
            if number == 0:
                bag.camera_info("/camera/color/camera_info", ns, CAMERA, k)
                bag.camera_info("/camera/aligned_depth_to_color/camera_info", ns, CAMERA, k)
            if kind.poses == "tf":
                bag.transform("/tf", ns, "world", CAMERA, frame.X_WC)
            elif kind.poses == "stamped":
                bag.pose("/pose", ns, "world", frame.X_WC)
            if kind.color == "png":
                bag.compressed(
                    "/camera/color/image_raw/compressed",
                    ns,
                    CAMERA,
                    png(frame.color),
                    "rgb8; png compressed bgr8",
                )
            else:
                pixels = frame.color[..., ::-1] if kind.color == "bgr8" else frame.color
                bag.image("/camera/color/image_raw", ns, CAMERA, pixels, kind.color)
            write_depth(bag, base, ns, CAMERA, frame.depth, kind.depth)
    return bag.path
