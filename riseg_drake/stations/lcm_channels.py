"""Where the drivers of the Panda and of the RealSense camera speak: LCM network, channels, buffers."""

from dataclasses import dataclass
from ipaddress import IPv4Address
from pathlib import Path
from urllib.parse import urlsplit

from pydrake.lcm import DrakeLcm

RECEIVE_LIMIT = Path("/proc/sys/net/core/rmem_max")
"""Where Linux says how large a receive buffer a program may ask for, bytes."""

LONGEST_NAME = 38
"""Of a channel or serial number, letters: LCM takes 63, and an image channel's begins with 25 of its own."""

ARM_DRIVERS = "`riseg drive-arm` or drake-franka-driver"
CAMERA_DRIVERS = "`riseg drive-camera` or realsense_rgbd_publisher"
"""The programs that speak as the arm and as the camera, for people; one of each is wanted."""

_KINDS = ("udpm", "tcpq", "file", "memq")


@dataclass
class LcmConfig:
    """The LCM network and the channels of one robot with one camera."""

    url: str = "udpm://239.255.76.67:7667?ttl=0&recv_buf_size=4194304"
    """LCM's default network, kept within this machine (ttl=0; 1 for the local network), with a receive
    buffer that holds several pictures: with the default one of 200 kB most of them are lost."""
    status_channel: str = "PANDA_STATUS"
    command_channel: str = "PANDA_COMMAND"
    camera_serial: str = "emulated"
    """Serial number of the camera; `realsense_rgbd_publisher --dump_camera_ids` prints it."""

    def check(self) -> None:
        """Raise ValueError for names that LCM does not take."""
        for name in ("status_channel", "command_channel", "camera_serial"):
            said = getattr(self, name)
            if not 0 < len(said) <= LONGEST_NAME or not said.isprintable():
                raise ValueError(f"{name} is {said[:80]!r}; expected 1 to {LONGEST_NAME} letters")
        if (said := self.status_channel) == self.command_channel:
            raise ValueError(f"command_channel is {said!r}, as status_channel is; expected another")

    @property
    def recovery_channel(self) -> str:
        """Where `riseg hardware` sends the operator's word that a stopped arm may move again."""
        return f"{self.command_channel}_RECOVERY"

    @property
    def errors_channel(self) -> str:
        """Where `riseg drive-arm` says by name why the arm does not move, for which a status has no field."""
        return f"{self.status_channel}_ERRORS"

    @property
    def image_channel(self) -> str:
        """Where the camera's driver publishes."""
        return f"DRAKE_RGBD_CAMERA_IMAGES_{self.camera_serial}"


class LcmError(RuntimeError):
    """LCM cannot be used as asked; the message says in one line what would be right."""


def open_lcm(config: LcmConfig) -> DrakeLcm:
    """A connection of its own to the network; one thread at a time may use it. Raises LcmError."""
    # LCM itself prints a line for what it does not know, raises nothing, and is deaf and mute from then on.
    if not _is_network(config.url):
        raise LcmError(f"no LCM at {config.url!r}; expected a URL such as {LcmConfig.url!r}")
    return DrakeLcm(config.url)


def _is_network(url: str) -> bool:
    """Whether LCM knows the kind, and a group of hosts that hear each other has such an address."""
    try:
        parts = urlsplit(url)
        group = parts.hostname is None or IPv4Address(parts.hostname).is_multicast
        return parts.scheme in _KINDS and parts.port != 0 and (parts.scheme != "udpm" or group)
    except ValueError:
        return False


def receive_buffer_wanted(url: str) -> int:
    """The bytes of receive buffer that an LCM URL asks for; 0 where it does not say."""
    _, _, options = url.partition("?")
    for option in options.split("&"):
        key, _, value = option.partition("=")
        if key == "recv_buf_size" and value.isdecimal():
            return int(value)
    return 0


def receive_buffer_warning(url: str, limit_file: Path = RECEIVE_LIMIT) -> str:
    """One line on which sysctl to set, where the system allows less buffer than the URL asks for; else "".

    The kernel grants what it allows and says nothing, and images are lost.
    """
    if not url.startswith("udpm://"):
        return ""
    try:
        allowed = int(limit_file.read_text())
    except (OSError, ValueError):  # not Linux: nothing is known
        return ""
    wanted = receive_buffer_wanted(url)
    if wanted == 0:
        return f"images will be lost with LCM's default buffer: add recv_buf_size=4194304 to the URL {url}"
    if allowed >= wanted:
        return ""
    return (
        f"the system allows receive buffers of {allowed} bytes and {wanted} are wanted, so images will be "
        f"lost: sudo sysctl -w net.core.rmem_max={wanted}"
    )
