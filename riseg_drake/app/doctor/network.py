"""What a real robot needs of the network: LCM's buffers, multicast on this machine, drivers that are heard."""

import time
from collections import Counter

from riseg_drake.app.doctor.finding import Finding
from riseg_drake.stations.lcm_channels import (
    ARM_DRIVERS,
    CAMERA_DRIVERS,
    LcmConfig,
    LcmError,
    open_lcm,
    receive_buffer_warning,
)

CHANNEL = "RISEG_DOCTOR"
"""Where it speaks to itself."""
LISTENING = 1.0
"""How long drivers are listened for, s: the slowest of them speaks six times a second."""


def receive_buffers(config: LcmConfig) -> Finding:
    """Whether the system grants buffers that hold a picture."""
    warning = receive_buffer_warning(config.url)
    return Finding("LCM's receive buffers", not warning, "too small" if warning else "large enough", warning)


def loopback(config: LcmConfig) -> Finding:
    """Whether what is said on LCM is heard on the same machine."""
    about, remedy = (
        "LCM on this machine",
        "the emulator and the drivers are not heard: sudo ip link set lo multicast on && "
        "sudo ip route add 224.0.0.0/4 dev lo",
    )
    heard: list[bytes] = []
    try:
        lcm = open_lcm(config)
        lcm.Subscribe(CHANNEL, heard.append)
        lcm.Publish(CHANNEL, b"1")
        deadline = time.monotonic() + LISTENING
        while not heard and time.monotonic() < deadline:
            lcm.HandleSubscriptions(100)
    except (LcmError, RuntimeError) as error:
        return Finding(about, False, str(error), remedy)
    says = f"heard itself at {config.url}" if heard else f"nothing is heard at {config.url}"
    return Finding(about, bool(heard), says, "" if heard else remedy)


def drivers(config: LcmConfig) -> list[Finding]:
    """Whether the programs of arm and camera speak on the channels of the scenario, and what else does."""
    count: Counter[str] = Counter()
    try:
        lcm = open_lcm(config)
        lcm.SubscribeAllChannels(lambda channel, _: count.update([channel]))
        end = time.monotonic() + LISTENING
        while time.monotonic() < end:
            lcm.HandleSubscriptions(50)
    except (LcmError, RuntimeError):  # the line above has said so
        pass
    wanted = {
        config.status_channel: ("arm's driver", ARM_DRIVERS),
        config.image_channel: ("camera's driver", CAMERA_DRIVERS),
    }
    findings = []
    for channel, (about, programs) in wanted.items():
        rate = count.pop(channel, 0) / LISTENING
        says = f"{channel} at {rate:.0f} Hz" if rate else f"nothing on {channel}"
        remedy = "" if rate else f"only `riseg hardware` needs it: start {programs}, or `riseg emulate`"
        findings.append(Finding(about, rate > 0, says, remedy))
    if others := sorted(set(count) - {CHANNEL}):
        findings.append(Finding("also heard on LCM", True, ", ".join(others)))
    return findings
