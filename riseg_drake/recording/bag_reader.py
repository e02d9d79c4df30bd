"""Reads the frames of one RGB-D camera out of a ROS bag, in two passes: stamps and poses, then images."""

from array import array
from collections import Counter, deque
from collections.abc import Iterator, Sequence
from decimal import Decimal
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from riseg_drake.host.images import DamagedImageError
from riseg_drake.recording.bag_file import opened_bag
from riseg_drake.recording.bag_images import color_image, depth_image, is_depth
from riseg_drake.recording.bag_messages import BagMessages, pose_numbers
from riseg_drake.recording.bag_topics import (
    ROLES,
    CameraInfo,
    ImageTopic,
    aligned,
    camera_info,
    chosen_pair,
    image_topic,
    info_topics,
)
from riseg_drake.recording.bag_transforms import TransformTree, stamped_table
from riseg_drake.recording.layout import (
    LeftOut,
    RecordedFrame,
    RecordingError,
    unlikely_camera,
)
from riseg_drake.recording.registration import Registration
from riseg_drake.recording.source import RecordedSource, SourceOptions
from riseg_drake.recording.stamped_lists import StampedTable, nearest_time, pose_between, row_between

MOST_WAITING = 2**27
"""Bytes of images that wait for their partners; where it is more, the bag is not in the order of time."""
PANDA = [f"joint{k}" for k in range(1, 8)]
"""How the names of the joints of a Panda or an FR3 end."""


class BagReader(RecordedSource):
    """Streams the frames of a bag; only stamps, transforms and joint angles are held in memory.

    Raises RecordingError for what is no bag, or none of one RGB-D camera: see `chosen_pair`.
    """

    def __init__(self, path: Path, options: SourceOptions):
        self.path = path
        self.left_out: list[LeftOut] = []
        self.warnings: list[str] = []
        self.joints: StampedTable | None = None
        self._options = options
        self._poses: StampedTable | None = None
        self._world: str | None = None
        if unknown := set(options.topics) - set(ROLES):
            raise RecordingError(f"--topics: {unknown.pop()!r} is none of {', '.join(ROLES)}")
        with opened_bag(path) as bag:
            for role, topic in options.topics.items():
                if topic not in bag.types:
                    raise RecordingError(f"{path} has no messages on {topic} (--topics {role}=)")
            self._transforms = _transforms(bag)
            self._color, self._depth = chosen_pair(
                _images(bag, options.topics), options.topics, self._transforms.connected, str(path)
            )
            self.registration = self._registered(self._color, self._depth)
            """How its images become those of one pinhole."""
            self._unit = bag.depth_unit(self._depth.name)
            self.depth_scale = float(1 / Decimal(str(self._unit)))
            self._read_stamps(bag)
            self._find_joints(bag)
        self.intrinsics = self.registration.intrinsics
        self.warnings += [f"{path}: {odd}" for odd in unlikely_camera(self.intrinsics)]
        self.camera_poses = self._find_poses(bag)
        self._frames = self._associated()

    def __len__(self) -> int:
        return len(self._frames)

    def times(self) -> list[float]:
        """Of all frames, s."""
        return [color / 10**9 for color, _ in self._frames]

    def __iter__(self) -> Iterator[RecordedFrame]:
        first_damage, frames = "", 0
        for number, (time, color, depth) in enumerate(self._messages(), start=1):
            try:
                frame = self._frame(number, time, color, depth)
            except DamagedImageError as damage:
                first_damage = first_damage or str(damage)
                self._leave_out(number, str(damage))
                continue
            if frames == 0:
                self._look_at_scale(frame.depth, f"{self.path}: {self._depth.name}")
            frames += 1
            yield frame
        if frames == 0:
            raise RecordingError(f"{self.path}: no frame can be read: {first_damage}")

    def frames_at(self, numbers: Sequence[int]) -> dict[int, RecordedFrame | None]:
        """Some frames by their numbers, from 0, in one pass; None for those that are damaged."""
        wanted, found = set(numbers), dict[int, RecordedFrame | None]()
        for number, images in enumerate(self._messages()):
            if number in wanted:
                try:
                    found[number] = self._frame(number + 1, *images)
                except DamagedImageError:
                    found[number] = None
                if len(found) == len(wanted):
                    break
        return found

    def leave_out(self, frame: RecordedFrame, why: str) -> None:
        """Note that a frame was passed over."""
        self._leave_out(frame.line, why)

    def _leave_out(self, number: int, why: str) -> None:
        self.left_out.append(LeftOut(f"{self.path}: {self._color.name}", number, why, "image"))

    def _frame(self, number: int, time: int, color: Any, depth: Any) -> RecordedFrame:
        seconds, limit = time / 10**9, self._options.stamp_limit
        name = f"{self._color.name} at {seconds!r} s"
        image = color_image(color, name)
        metres = depth_image(depth, f"{self._depth.name} at {seconds!r} s", self._unit)
        for found, right in (
            (image.shape[:2], self.registration.color.intrinsics.shape),
            (metres.shape, self.registration.depth_shape),
        ):
            if found != right:
                raise DamagedImageError(
                    f"{name} has {found[1]}x{found[0]} pixels, its CameraInfo says {right[1]}x{right[0]}"
                )
        return RecordedFrame(
            time=seconds,
            color=self.registration.registered_color(image),
            depth=self.registration.registered_depth(metres),
            X_WC=self._pose_at(seconds),
            position=None if self.joints is None else row_between(self.joints, seconds, limit),
            name=f"{number - 1:06d}.png",
            line=number,
        )

    def _messages(self) -> Iterator[tuple[int, Any, Any]]:
        """(stamp in ns, colour, depth) of the frames in their order, each as soon as both are there."""
        frames = deque(self._frames)
        due = {self._color.name: Counter(c for c, _ in frames), self._depth.name: Counter(d for _, d in frames)}
        waiting: dict[str, dict[int, bytes]] = {topic: {} for topic in due}
        size = 0
        with opened_bag(self.path) as bag:
            for topic, recorded, raw in bag.messages(due):
                time = bag.stamp(topic, raw, recorded)
                if due[topic][time] == 0 or time in waiting[topic]:
                    continue
                waiting[topic][time] = raw
                size += len(raw)
                while frames and all(t in w for t, w in zip(frames[0], waiting.values(), strict=True)):
                    pair = frames.popleft()
                    yield pair[0], *(bag.message(t, waiting[t][s]) for t, s in zip(due, pair, strict=True))
                    for t, s in zip(due, pair, strict=True):
                        due[t][s] -= 1
                        if due[t][s] == 0:
                            size -= len(waiting[t].pop(s))
                if size > MOST_WAITING:
                    raise RecordingError(
                        f"{self.path}: images of {self._color.name} and {self._depth.name} that belong "
                        f"together lie more than {MOST_WAITING / 2**20:g} MB apart in the bag"
                    )

    def _registered(self, color: ImageTopic, depth: ImageTopic) -> Registration:
        if aligned(color, depth):
            return Registration(color.lens)
        C, D = color.optical_frame, depth.optical_frame
        if moving := self._transforms.moving(C, D):
            raise RecordingError(f"{self.path}: {C} and {D} are not fixed to each other ({moving[0]} moves)")
        self.warnings.append(f"depth of {depth.name} is not aligned to colour; the program aligns it")
        return Registration(color.lens, depth.lens, self._transforms.X_AB(C, D, 0.0, 1.0))

    def _read_stamps(self, bag: BagMessages) -> None:
        """The first pass: stamps of images, and all rows of poses and joint angles."""
        self._stamps: dict[str, list[int]] = {self._color.name: [], self._depth.name: []}
        pose, joints = self._options.topics.get("pose"), _joint_topic(bag, self._options.topics)
        times, rows = array("d"), array("d")
        self._states: list[tuple[float, tuple[str, ...], list[float]]] = []
        for topic, recorded, raw in bag.messages({*self._stamps, *filter(None, (pose, joints))}):
            time = bag.stamp(topic, raw, recorded)
            if topic in self._stamps:
                self._stamps[topic].append(time)
                continue
            message = bag.message(topic, raw)
            if topic == pose:
                times.append(time / 10**9)
                pose_of = getattr(message.pose, "pose", message.pose)
                rows.extend(pose_numbers(pose_of.position, pose_of.orientation))
            else:
                self._states.append((time / 10**9, tuple(message.name), list(message.position)))
        if pose is not None:
            self._poses = stamped_table(pose, times, rows)

    def _find_joints(self, bag: BagMessages) -> None:
        """The angles of the joints that most messages name, where it is known what they belong to."""
        if not self._states:
            return
        names = Counter(names for _, names, _ in self._states).most_common(1)[0][0]
        topic = _joint_topic(bag, self._options.topics) or ""
        asked = self._options.robot or "joints" in self._options.topics
        if not asked:
            self.warnings.append(f"{topic} is not used; --robot names the robot that its joint angles are of")
            return
        rows = [(t, q) for t, n, q in self._states if n == names and len(q) == len(names)]
        if not rows:
            raise RecordingError(f"{self.path}: {topic} holds no positions of joints")
        times, values = array("d", [t for t, _ in rows]), array("d", [v for _, q in rows for v in q])
        self.joints = stamped_table(topic, times, values, list(names))

    def _find_poses(self, bag: BagMessages) -> str | None:
        """Where the camera's poses come from, in words; None if it stands still."""
        if self._poses is not None:
            return self._options.topics["pose"]
        camera, world = self._color.optical_frame, self._options.world_frame
        line = self._transforms.ancestors(camera)
        if world is not None and (camera == world or not self._transforms.connected(world, camera)):
            frames = ", ".join(sorted(self._transforms.frames())[:12]) or "none"
            raise RecordingError(
                f"{self.path}: --world-frame {world} is not above {camera}; there are {frames}"
            )
        self._world = world or line[-1]
        if not self._transforms.moving(self._world, camera):
            others = [topic for topic, kind in bag.types.items() if kind in ("PoseStamped", "Odometry")]
            if others:
                self.warnings.append(
                    f"{others[0]} is not used; --topics pose={others[0]} takes it for the camera's pose X_WC"
                )
            self._world = None
            return None
        return f"TF, {camera} in {self._world}"

    def _pose_at(self, time: float) -> NDArray[np.float64] | None:
        """X_WC [4, 4] at a moment, s."""
        limit = self._options.stamp_limit
        if self._poses is not None:
            return pose_between(self._poses, time, limit)
        if self._world is None:
            return None
        return self._transforms.X_AB(self._world, self._color.optical_frame, time, limit)

    def _associated(self) -> list[tuple[int, int]]:
        """Stamps of colour and depth images that belong together, ns, where all else is known of them, too."""
        limit = self._options.stamp_limit
        depths = np.array(sorted(set(self._stamps[self._depth.name])), np.int64)
        frames, lonely = [], Counter[str]()
        for number, color in enumerate(sorted(set(self._stamps[self._color.name])), start=1):
            seconds = color / 10**9
            depth = int(depths[nearest_time(depths, color)])
            lacks = ""
            if abs(depth - color) > limit * 10**9:
                lacks = self._depth.name
            elif self.camera_poses is not None and self._pose_at(seconds) is None:
                lacks = self.camera_poses
            elif self.joints is not None and self.joints.bracket(seconds, limit) is None:
                lacks = str(self.joints.path)
            if lacks:
                lonely[lacks] += 1
                self._leave_out(number, f"{lacks} has nothing within {limit:g} s of it")
            else:
                frames.append((color, depth))
        if not frames:
            raise RecordingError(
                f"{self.path}: no image of {self._color.name} has a partner in {lonely.most_common(1)[0][0]} "
                f"within {limit:g} s; allow more with --stamp-limit"
            )
        return frames


def _images(bag: BagMessages, asked: Any) -> list[ImageTopic]:
    """All topics of colour and depth images, with their cameras."""
    cameras: dict[str, CameraInfo | None] = {}
    for topic, kind in bag.types.items():
        if kind == "CameraInfo":
            cameras[topic] = camera_info(bag.first(topic))
    images = []
    for topic, kind in sorted(bag.types.items()):
        if kind not in ("Image", "CompressedImage"):
            continue
        message = bag.first(topic)
        named = asked.get("depth_info" if is_depth(message, topic) else "color_info")
        places = [named] if named else info_topics(topic)
        camera = next((cameras[place] for place in places if cameras.get(place) is not None), None)
        if camera is None:
            frame = str(message.header.frame_id).lstrip("/")
            same = [c for c in cameras.values() if c is not None and c.frame == frame]
            camera = same[0] if len(same) == 1 else None
        image = image_topic(topic, message, camera)
        if image is not None:
            images.append(image)
    return images


def _transforms(bag: BagMessages) -> TransformTree:
    tree = TransformTree()
    for each in bag.transforms():
        tree.add(each.parent, each.child, each.time, each.pose, static=each.static)
    return tree


def _joint_topic(bag: BagMessages, asked: Any) -> str | None:
    topics = [topic for topic, kind in sorted(bag.types.items()) if kind == "JointState"]
    return asked.get("joints") or (topics[0] if topics else None)
