"""What an emulator can be told to do wrong, and the words for it."""

from collections import deque
from dataclasses import dataclass, fields
from heapq import heappop, heappush
from itertools import count

import numpy as np

CONTROL_CHANNEL = "RISEG_EMULATOR_CONTROL"
"""One word as plain UTF-8 text a message."""

STREAMS = ("images", "status")
WORDS = (
    "images|status drop SHARE, delay SECONDS, duplicate SHARE, reorder SHARE, or stall SECONDS; reflex; "
    "stop; recover; die; die SECONDS; start; guide JOINT RADIANS; guide RADIANS (7 of them)"
)
"""All that can be said, for people."""

_OF_ARM = ("reflex", "stop", "recover", "die", "start")
_LONGEST = 60.0  # s
_TURN = 6.3  # rad


class WordError(ValueError):
    """A word that the emulator does not know; the message lists those that it does."""


@dataclass
class Faults:
    """How often a stream of messages goes wrong; the chances are each message's own."""

    drop: float = 0.0
    """Share of messages that are lost."""
    delay: float = 0.0
    """Longest delay, s; each message waits for a random part of it, so that some overtake others."""
    duplicate: float = 0.0
    """Share of messages that arrive twice."""
    reorder: float = 0.0
    """Share of messages that arrive only after their successor."""


@dataclass(frozen=True)
class Word:
    """One thing said to the emulator."""

    subject: str
    """`images`, `status` or `arm`."""
    verb: str
    """A field of Faults, `stall`, `reflex`, `stop` (the button), `recover`, `die`, `start` or `guide`."""
    amount: float = 0.0
    """A share, or seconds."""
    posture: tuple[float, ...] = ()
    """Of `guide`: 7 joint angles, rad, or the number of a joint, 1 to 7, and by how much it is turned, rad."""


def parse_word(text: str) -> Word:
    """What a person or program said, such as `images drop 0.1` or `reflex`. Raises WordError."""
    match text.split():
        case [verb] if verb in _OF_ARM:
            return Word("arm", verb)
        case ["guide", joint, angle] if joint in set("1234567"):
            return Word("arm", "guide", posture=(float(joint), _number(angle, _TURN, text, -_TURN)))
        case ["guide", *angles] if len(angles) == 7:
            posture = tuple(_number(angle, _TURN, text, -_TURN) for angle in angles)
            return Word("arm", "guide", posture=posture)
        case ["die", seconds]:
            return Word("arm", "die", _number(seconds, _LONGEST, text))
        case [stream, "stall" | "delay" as verb, seconds] if stream in STREAMS:
            return Word(stream, verb, _number(seconds, _LONGEST, text))
        case [stream, verb, share] if stream in STREAMS and verb in {field.name for field in fields(Faults)}:
            return Word(stream, verb, _number(share, 1.0, text))
    raise WordError(f"{text.strip()!r} is not known to the emulator; it knows {WORDS}")


def _number(text: str, most: float, said: str, least: float = 0.0) -> float:
    try:
        number = float(text)
    except ValueError:
        number = np.nan
    if not least <= number <= most:
        raise WordError(f"{said.strip()!r}: {text} is not a number from {least:g} to {most:g}")
    return number


class UnreliableLink:
    """Carries messages from a driver to the network with the faults that it was told; repeatable by seed.

    Give it each message with `send`, and publish what `due` hands out, in that order.
    """

    def __init__(self, rng: np.random.Generator):
        self.faults = Faults()
        self._rng = rng
        self._stalled_until = -np.inf
        self._held_back: deque[bytes] = deque()
        self._waiting: list[tuple[float, int, bytes]] = []
        self._numbers = count()

    def obey(self, word: Word, now: float) -> None:
        """Change what goes wrong; `now` is the time, s."""
        if word.verb == "stall":
            self._stalled_until = now + word.amount
        else:
            setattr(self.faults, word.verb, word.amount)

    def is_stalled(self, now: float) -> bool:
        """Whether the sender hangs at the time `now`, s: it neither sends nor listens."""
        return now < self._stalled_until

    def send(self, message: bytes, now: float) -> None:
        """Take a message at time `now`, s."""
        faults = self.faults
        if self.is_stalled(now) or self._happens(faults.drop):
            return
        if self._happens(faults.reorder):
            self._held_back.append(message)
            return
        copies = [message, message] if self._happens(faults.duplicate) else [message]
        for copy in copies + list(self._held_back):
            delay = self._rng.uniform(0, faults.delay) if faults.delay > 0 else 0.0
            heappush(self._waiting, (now + delay, next(self._numbers), copy))
        self._held_back.clear()

    def due(self, now: float) -> list[bytes]:
        """The messages that arrive by the time `now`, s, in their order of arrival."""
        arrived = []
        while self._waiting and self._waiting[0][0] <= now and not self.is_stalled(now):
            arrived.append(heappop(self._waiting)[2])
        return arrived

    def next_arrival(self) -> float:
        """When the next message arrives, s; inf if none is under way."""
        return self._waiting[0][0] if self._waiting else np.inf

    def _happens(self, share: float) -> bool:
        return share > 0 and bool(self._rng.uniform() < share)
