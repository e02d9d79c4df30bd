"""Messages that no driver sends, made from such that it does: cut off, garbled, of other times and places."""

import struct

import numpy as np
from drake import lcmt_image_array, lcmt_panda_status

SLOTS = [name for name in lcmt_panda_status.__slots__ if name.startswith("joint_")]
WRONG_NUMBERS = [np.nan, np.inf, -np.inf, 1e300, -1e300, 1e6, -17.0]
NEVER_NOW = [3600.0, -3600.0, -1.0, -0.05, 1e12, -1e12]
WRONG_STAMPS = [*NEVER_NOW, 1.0, 0.05, 0.019]
"""s from now."""
LONGEST_STAMP = 2**63 - 1


def mutated_status(rng, message, stamps=WRONG_STAMPS):
    """Bytes like those of a status, with one thing wrong; what is not is as in `message`."""
    data = message.encode()
    match rng.integers(8):
        case 0:
            return data[: rng.integers(len(data))]
        case 1:
            return data + rng.bytes(rng.integers(1, 600))
        case 2:
            return rng.bytes(rng.integers(600))
        case 3:
            # Seldom in what it says: three that can be true are two drivers that contradict each other.
            head = len(data) if rng.random() < 0.01 else 20
            return garbled(rng, data[:head]) + data[head:]
        case 4:
            joints = rng.choice([0, 1, 6, 8, 56, -1, 2**31 - 1, -(2**31), rng.integers(-(2**31), 2**31)])
            return data[:16] + struct.pack(">i", joints) + data[20:]
        case 5:
            field, joint = rng.integers(len(SLOTS)), rng.integers(7)
            place = 20 + 8 * (7 * field + joint)
            return data[:place] + struct.pack(">d", rng.choice(WRONG_NUMBERS)) + data[place + 8 :]
        case 6:
            return stamped(data, 8, rng.choice(stamps), message.utime, rng)
        case _:
            return data[:-10] + struct.pack(">b", rng.choice([-1, 7, 99])) + data[-9:]


def mutated_picture(rng, message):
    """The same for a message of the camera's driver."""
    data = message.encode()
    match rng.integers(5):
        case 0:
            return data[: rng.integers(len(data))]
        case 1:
            return rng.bytes(rng.integers(60))
        case 2:
            return garbled(rng, data[:8]) + data[8:]
        case 3:
            return data[:8] + rng.bytes(rng.integers(30))
        case _:
            return stamped(data, 12, rng.choice(WRONG_STAMPS), message.header.utime, rng)


def garbled(rng, data):
    """With some bytes that are others."""
    array = np.frombuffer(data, np.uint8).copy()
    places = rng.integers(len(array), size=rng.integers(1, 20))
    array[places] = rng.integers(256, size=len(places))
    return array.tobytes()


def stamped(data, place, ahead, utime, rng):
    """With a stamp that is `ahead` s later, or of no time at all."""
    utime = (
        int(rng.choice([-LONGEST_STAMP, 0, LONGEST_STAMP])) if rng.random() < 0.2 else utime + int(1e6 * ahead)
    )
    return data[:place] + struct.pack(">q", utime) + data[place + 8 :]


def picture_message(now):
    """A message of the camera of a time, s, without any picture in it."""
    message = lcmt_image_array()
    message.header.utime = round(1e6 * now)
    return message
