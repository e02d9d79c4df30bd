"""Why an arm's driver does not move it, by name, on a channel of its own: a status has no field for that."""

from drake import lcmt_drake_signal


def reasons_message(state: str, reasons: list[str], now: float) -> lcmt_drake_signal:
    """What the driver does at a time, s, and why, by the names of errors where the robot has some."""
    message = lcmt_drake_signal()
    message.timestamp = int(1e3 * now)
    message.coord = [state, *reasons]
    message.val = [1.0] * len(message.coord)
    message.dim = len(message.coord)
    return message


def told_reasons(data: bytes) -> str:
    """What such a message says, in one line; empty for what is none. Never raises: LCM calls it from C."""
    try:
        said = [str(word) for word in lcmt_drake_signal.decode(data).coord]
    except Exception:
        return ""
    line = " ".join(": ".join(part for part in (said[0], ", ".join(said[1:])) if part).split()) if said else ""
    return line if line.isprintable() else ""
