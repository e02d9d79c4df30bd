"""Which topics of a bag are one RGB-D camera."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from riseg_drake.geometry.camera import Intrinsics
from riseg_drake.geometry.lens import Lens
from riseg_drake.recording.bag_images import encoding_of, is_color, is_compressed, is_depth, shape_of
from riseg_drake.recording.layout import RecordingError, camera_from_json
from riseg_drake.recording.registration import lens_of

ROLES = ("color", "depth", "color_info", "depth_info", "pose", "joints")
"""What topics can be named for."""
MOST_NAMED = 12
"""Topics that an error names at most."""


@dataclass(frozen=True)
class CameraInfo:
    """What a sensor_msgs/CameraInfo says."""

    frame: str
    raw: Lens
    rectified: Lens


@dataclass(frozen=True)
class ImageTopic:
    """A topic of images, by its first message."""

    name: str
    depth: bool
    encoding: str
    shape: tuple[int, int]
    frame: str
    camera: CameraInfo | None

    @property
    def base(self) -> str:
        """The topic without what a transport adds to it."""
        return image_base(self.name)

    @property
    def lens(self) -> Lens:
        """That of these images. Images that are called rectified have no distortion any more."""
        assert self.camera is not None
        return self.camera.rectified if "rect" in self.base.rsplit("/", 1)[-1] else self.camera.raw

    @property
    def optical_frame(self) -> str:
        """The camera's frame."""
        return self.frame or (self.camera.frame if self.camera else "")

    def __str__(self) -> str:
        height, width = self.shape
        lacks = "" if self.camera else ", no CameraInfo"
        return f"{self.name} ({self.encoding} {width}x{height}, frame {self.optical_frame!r}{lacks})"


def image_base(topic: str) -> str:
    """A topic of images without what a transport adds to it."""
    return topic.removesuffix("/compressedDepth").removesuffix("/compressed")


def camera_info(message: Any) -> CameraInfo | None:
    """The camera of a CameraInfo; None where it was never calibrated. Raises RecordingError."""
    K, P = (getattr(message, name, getattr(message, name.upper(), None)) for name in ("k", "p"))
    D = getattr(message, "d", getattr(message, "D", ()))
    if K is None or not K[0]:
        return None
    size = {"width": int(message.width), "height": int(message.height), "depth_scale": 1.0}
    raw = _intrinsics(size, K[0], K[4], K[2], K[5])
    rectified = _intrinsics(size, P[0], P[5], P[2], P[6]) if P is not None and P[0] else raw
    model = str(message.distortion_model).lower()
    fisheye = model in ("equidistant", "fisheye", "kannala_brandt4")
    if model == "kannala brandt4":  # a RealSense file's word, with a number that is not used
        fisheye, D = True, D[:4]
    distortion = tuple(float(k) for k in D) if any(D) else ()
    return CameraInfo(
        str(message.header.frame_id).lstrip("/"), lens_of(raw, distortion, fisheye=fisheye), Lens(rectified)
    )


def image_topic(name: str, message: Any, camera: CameraInfo | None) -> ImageTopic | None:
    """A topic by its first message; None where it is neither colour nor depth."""
    depth = is_depth(message, name)
    if not depth and not is_color(message):
        return None
    frame = str(message.header.frame_id).lstrip("/")
    encoding = "compressed" if is_compressed(message) else encoding_of(message)
    return ImageTopic(name, depth, encoding, shape_of(message), frame, camera)


def info_topics(image: str) -> list[str]:
    """Where the CameraInfo of an image topic may be found, likeliest first."""
    parent = image_base(image).rsplit("/", 1)[0]
    return [f"{parent}/camera_info", f"{parent.rsplit('/', 1)[0]}/info/camera_info"]


def aligned(color: ImageTopic, depth: ImageTopic) -> bool:
    """Whether depth belongs to the pixels of the colour image."""
    if color.shape != depth.shape or color.optical_frame != depth.optical_frame:
        return False
    return depth.camera is None or depth.lens.intrinsics == color.lens.intrinsics


def chosen_pair(
    images: list[ImageTopic], asked: Mapping[str, str], related: Callable[[str, str], bool], bag: str
) -> tuple[ImageTopic, ImageTopic]:
    """The topics of colour and of depth that belong together.

    Args:
        images: all there are.
        asked: topics by role, as a person gave them.
        related: whether one frame's pose in another is known.
        bag: what errors call it.

    Raises RecordingError, which lists the topics, where none or several pairs would do.
    """
    colors = _candidates([i for i in images if not i.depth], asked.get("color"))
    depths = _candidates([i for i in images if i.depth], asked.get("depth"))
    for kind, found in (("colour", colors), ("depth", depths)):
        if not found:
            raise RecordingError(f"{bag}: no topic holds {kind} images; {_listed(images)}")
    known = [c for c in colors if c.camera is not None]
    if not known:
        raise RecordingError(
            f"{bag}: {colors[0].name} has no CameraInfo; name its topic with --topics color_info=TOPIC"
        )
    pairs = [(c, d) for c in known for d in depths if aligned(c, d)] or [
        (c, d)
        for c in known
        for d in depths
        if d.camera is not None and related(c.optical_frame, d.optical_frame)
    ]
    if not pairs:
        raise RecordingError(
            f"{bag}: no depth is aligned to colour, nor is a transform known between their cameras' frames; "
            f"record aligned depth, or tf_static and both CameraInfo; {_listed(images)}"
        )
    if len(pairs) > 1:
        raise RecordingError(
            f"{bag}: several topics would do; choose by --topics color=TOPIC,depth=TOPIC; "
            f"{_listed([image for image in images if image in sum(pairs, ())])}"
        )
    return pairs[0]


def _candidates(images: list[ImageTopic], asked: str | None) -> list[ImageTopic]:
    """Those that are asked for, or all; where one is there raw and compressed, the raw one."""
    if asked is not None:
        return [image for image in images if image.name == asked]
    best: dict[str, ImageTopic] = {}
    for image in images:
        if image.base not in best or len(image.name) < len(best[image.base].name):
            best[image.base] = image
    return list(best.values())


def _listed(images: list[ImageTopic]) -> str:
    if not images:
        return "it has no images of colour or depth"
    more = f" and {len(images) - MOST_NAMED} more" if len(images) > MOST_NAMED else ""
    return f"it has {', '.join(map(str, images[:MOST_NAMED]))}{more}"


def _intrinsics(size: dict[str, float], fx: float, fy: float, cx: float, cy: float) -> Intrinsics:
    return camera_from_json({**size, "fx": float(fx), "fy": float(fy), "cx": float(cx), "cy": float(cy)})[0]
