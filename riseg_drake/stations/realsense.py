"""The door to librealsense: a RealSense camera's colour, and depth that is aligned to it."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from riseg_drake.geometry.camera import Intrinsics
from riseg_drake.geometry.lens import Lens
from riseg_drake.host.terminal import one_line

PATIENCE = 5.0
"""A camera that sent nothing for so long is gone, s."""
_TOO_FAR = np.iinfo(np.uint16).max
_TICK = {True: 1e-6, False: 1e-4}
"""Of the option exposure, s: that of the infrared imagers, and that of a colour camera of its own."""


class RealSenseError(RuntimeError):
    """No librealsense, no camera, no such file; says in one line what would be right."""


@dataclass
class CameraDriverConfig:
    """What `riseg drive-camera` sets on a camera; the size of colour is that of the scenario's camera."""

    rate: int = field(default=30, metadata={"least": 5, "most": 90})
    """Pictures a second, Hz; the camera has a few rates for each size (rs-enumerate-devices -v)."""
    depth_width: int = field(default=848, metadata={"least": 16, "most": 1280})
    """Size of the depth images before they are aligned; the makers advise 848x480, on a D415 1280x720. px"""
    depth_height: int = field(default=480, metadata={"least": 16, "most": 800})
    """px"""
    color_exposure: float = field(default=0.0, metadata={"least": 0.0, "most": 0.2})
    """Fixed exposure of colour, s; 0: automatic. Light that changes with it looks like motion."""
    depth_exposure: float = field(default=0.0, metadata={"least": 0.0, "most": 0.2})
    """Fixed exposure of the infrared imagers, s; 0: automatic. A D405 takes colour by them, too."""
    emitter: bool = True
    """Whether the pattern projector is on; a D405 has none."""
    preset: str = field(
        default="default",
        metadata={"choices": ("default", "hand", "high_accuracy", "high_density", "medium_density")},
    )
    """The makers' settings of depth: fewer wrong pixels, or fewer holes."""


@dataclass(frozen=True)
class Shot:
    """What the camera took in one instant."""

    color: NDArray[np.uint8]
    """[H, W, 3], RGB, without the lens's distortion."""
    depth: NDArray[np.float32]
    """[H, W], m, aligned to colour, 0 = invalid."""
    time: float
    """Of colour, s, by the camera's stamp."""
    by_wall: bool
    """Whether that is the computer's time, and not a clock in the camera."""


def librealsense() -> Any:
    """The library. Raises RealSenseError with what to install."""
    try:
        import pyrealsense2

        return pyrealsense2
    except ImportError as error:
        remedy = "pip install 'riseg-drake[realsense]'"
        if "libusb" in str(error):
            remedy = "sudo apt-get install libusb-1.0-0"
        raise RealSenseError(f"RealSense cameras need librealsense ({one_line(error)}): {remedy}") from None


class RealSenseCamera:
    """A camera that streams, by librealsense's own pipeline, which pairs colour and depth. Use `opened_camera`.

    `config` is librealsense's, with the streams that are wanted. Raises RealSenseError where the device does
    not have them.
    """

    def __init__(self, config: Any, lacking: Sequence[str] = ()):
        self._rs = librealsense()
        self._pipeline = self._rs.pipeline()
        try:
            profile = self._pipeline.start(config)
        except RuntimeError as error:
            raise RealSenseError(
                f"the camera does not stream so ({one_line(error)}); rs-enumerate-devices lists the sizes and "
                "rates that it has, and camera.full_width, full_height and driver choose among them"
            ) from None
        self.name, self.serial = (
            _info(self._rs, profile.get_device(), key) for key in ("name", "serial_number")
        )
        color = profile.get_stream(self._rs.stream.color).as_video_stream_profile()
        self.lens = lens_of(color.get_intrinsics())
        """Of the colour camera; shots are those of its pinhole."""
        self.intrinsics = self.lens.intrinsics
        self.lacking = tuple(lacking)
        """Names of settings that this camera does not have."""

    def shots(self) -> Iterator[Shot]:
        """One after the other, for ever. Raises RealSenseError where the camera falls silent."""
        align = self._rs.align(self._rs.stream.color)
        try:
            while True:
                came, frames = self._pipeline.try_wait_for_frames(int(1000 * PATIENCE))
                if not came:
                    raise RealSenseError(
                        f"{self.name} sent nothing for {PATIENCE:g} s: is it still plugged in?"
                    )
                if frames.get_color_frame() and frames.get_depth_frame():
                    yield self._shot(align.process(frames))
        finally:
            self._pipeline.stop()

    def _shot(self, aligned: Any) -> Shot:
        color = aligned.get_color_frame()
        return Shot(
            self.lens.undistorted(np.asanyarray(color.get_data()).copy()),
            self.lens.undistorted(_metres(aligned.get_depth_frame()), nearest=True),
            color.get_timestamp() / 1000,
            color.get_frame_timestamp_domain() != self._rs.timestamp_domain.hardware_clock,
        )


class LibrealsenseAlignment:
    """Depth of one camera as another one beside it would have measured it, by librealsense.

    Args:
        color: the lens of the camera that depth is wanted for.
        depth: that of the depth camera.
        X_CD: its pose in the colour camera, [4, 4].
        unit: what librealsense shall count depth in, m.
    """

    def __init__(self, color: Lens, depth: Lens, X_CD: NDArray[np.float64], unit: float):
        self._rs, self._unit = (rs := librealsense()), unit
        self._device = rs.software_device()
        self._sensor = self._device.add_sensor("")
        self._sensor.add_read_only_option(rs.option.depth_units, unit)
        self._profiles = [
            self._sensor.add_video_stream(_stream(rs, stream, lens))
            for stream, lens in ((rs.stream.depth, depth), (rs.stream.color, color))
        ]
        offset = rs.extrinsics()
        offset.rotation, offset.translation = X_CD[:3, :3].T.ravel().tolist(), X_CD[:3, 3].tolist()
        self._profiles[0].register_extrinsics_to(self._profiles[1], offset)
        self._frames, self._joined = rs.frame_queue(2), rs.frame_queue(1)
        self._align, self._pair = rs.align(rs.stream.color), []  # type: ignore[var-annotated]
        self._joiner = rs.processing_block(
            lambda frame, source: source.frame_ready(source.allocate_composite_frame(self._pair))
        )
        self._joiner.start(self._joined)
        self._sensor.open(self._profiles)
        self._sensor.start(self._frames)
        k = color.intrinsics
        self._black = np.zeros((k.height, k.width, 3), np.uint8)
        self._number = 0

    def __call__(self, depth: NDArray[np.float32]) -> NDArray[np.float32]:
        """Depth [h, w], m, of the colour camera's pixels from that [H, W] of the depth camera's."""
        self._number += 1
        units = np.clip(np.rint(depth / self._unit), 0, _TOO_FAR).astype(np.uint16)
        self._pair[:] = [
            self._given(profile, pixels)
            for profile, pixels in zip(self._profiles, (units, self._black), strict=True)
        ]
        self._joiner.invoke(self._pair[0])
        aligned = self._align.process(self._joined.wait_for_frame().as_frameset())
        return _metres(aligned.get_depth_frame())

    def _given(self, profile: Any, pixels: Any) -> Any:
        """An image as a frame of librealsense."""
        frame = self._rs.software_video_frame()
        frame.pixels, frame.bpp, frame.stride = pixels, pixels[0, 0].nbytes, pixels[0].nbytes
        frame.timestamp, frame.domain = float(self._number), self._rs.timestamp_domain.system_time
        frame.frame_number, frame.profile = self._number, profile.as_video_stream_profile()
        frame.depth_units = self._unit
        self._sensor.on_video_frame(frame)
        return self._frames.wait_for_frame()


def opened_camera(serial: str | None, size: tuple[int, int], config: CameraDriverConfig) -> RealSenseCamera:
    """The camera with a serial number, or the only one, with its settings made, streaming colour of a size,
    (width, height) in pixels. Raises RealSenseError."""
    rs = librealsense()
    devices = {_info(rs, device, "serial_number"): device for device in rs.context().query_devices()}
    if not devices:
        raise RealSenseError(
            "no RealSense camera is found: plug it into a USB 3 port, and let your user open it "
            "(librealsense's 99-realsense-libusb.rules in /etc/udev/rules.d)"
        )
    if serial is None and len(devices) > 1:
        raise RealSenseError(f"there are the cameras {', '.join(devices)}; name one by lcm.camera_serial")
    if serial is not None and serial not in devices:
        raise RealSenseError(f"no camera has the serial number {serial}; there are {', '.join(devices)}")
    device = devices[serial] if serial is not None else next(iter(devices.values()))
    lacking, streams = set_up(device, config), rs.config()
    streams.enable_device(_info(rs, device, "serial_number"))
    depth = (config.depth_width, config.depth_height)
    streams.enable_stream(rs.stream.depth, *depth, rs.format.z16, config.rate)
    streams.enable_stream(rs.stream.color, *size, rs.format.rgb8, config.rate)
    return RealSenseCamera(streams, lacking)


def set_up(device: Any, config: CameraDriverConfig) -> list[str]:
    """Make the settings that a device has; returns the names of those that it lacks. Raises RealSenseError."""
    rs, lacking = librealsense(), []
    # Some cameras have a sensor of motion besides.
    sensors = [each for each in device.query_sensors() if each.is_depth_sensor() or each.is_color_sensor()]
    for sensor in sensors:
        stereo = bool(sensor.is_depth_sensor())
        exposure = config.depth_exposure if stereo else config.color_exposure
        if stereo and len(sensors) == 1 and config.color_exposure:
            exposure = config.color_exposure
        wanted: list[tuple[str, float]] = [("global_time_enabled", 1)]
        if stereo:
            # The preset first: it sets the others, too.
            wanted.append(("visual_preset", int(getattr(rs.rs400_visual_preset, config.preset))))
            wanted.append(("emitter_enabled", int(config.emitter)))
        wanted.append(("enable_auto_exposure", int(exposure == 0)))
        if exposure:
            wanted.append(("exposure", round(exposure / _TICK[stereo])))
        for name, value in wanted:
            option = getattr(rs.option, name)
            if not sensor.supports(option):
                lacking.append(name)
                continue
            try:
                sensor.set_option(option, value)
            except RuntimeError as error:
                raise RealSenseError(f"the camera refuses {name} = {value:g} ({one_line(error)})") from None
    return lacking


def _info(rs: Any, device: Any, key: str) -> str:
    what = getattr(rs.camera_info, key)
    return str(device.get_info(what)) if device.supports(what) else ""


def lens_of(k: Any) -> Lens:
    """The lens of librealsense's intrinsics; its models project as OpenCV's do.

    Raises RealSenseError for a model that OpenCV does not have.
    """
    intrinsics = Intrinsics(k.width, k.height, *(float(v) for v in (k.fx, k.fy, k.ppx, k.ppy)))
    model, distortion = str(k.model).rsplit(".", 1)[-1], tuple(float(c) for c in k.coeffs)
    if not any(distortion):
        return Lens(intrinsics)
    if model == "kannala_brandt4":
        return Lens(intrinsics, distortion[:4], fisheye=True)
    if "brown_conrady" in model:
        return Lens(intrinsics, distortion)
    raise RealSenseError(f"the lens has the model {model}, which OpenCV does not know")


def _stream(rs: Any, kind: Any, lens: Lens) -> Any:
    """A stream of librealsense, of depth or of colour."""
    stream, k, depth = rs.video_stream(), lens.intrinsics, kind == rs.stream.depth
    stream.type, stream.uid, stream.fps = kind, int(kind), 30
    stream.fmt, stream.bpp = (rs.format.z16, 2) if depth else (rs.format.rgb8, 3)
    stream.width, stream.height = k.width, k.height
    made = rs.intrinsics()
    made.width, made.height, made.fx, made.fy, made.ppx, made.ppy = k.width, k.height, k.fx, k.fy, k.cx, k.cy
    made.model, made.coeffs = rs.distortion.none, [0.0] * 5
    if not lens.is_pinhole:
        made.model = rs.distortion.kannala_brandt4 if lens.fisheye else rs.distortion.brown_conrady
        made.coeffs = [*lens.distortion, *[0.0] * 5][:5]
    stream.intrinsics = made
    return stream


def _metres(depth: Any) -> NDArray[np.float32]:
    """A depth frame [H, W] in m, 0 = invalid."""
    units = np.asanyarray(depth.get_data())
    return np.where(units == _TOO_FAR, 0, units).astype(np.float32) * np.float32(depth.get_units())
