"""What was tried and what went wrong, by kind; kept in a file, so that a trial may run in parts."""

import json
from collections import Counter
from pathlib import Path


class Tally:
    """Counts, and remembers each wrong case in words that are enough to repeat it."""

    def __init__(self, log: Path | None = None):
        self._log = log
        self.tried: Counter[str] = Counter()
        self.wrong: Counter[str] = Counter()
        if log is not None and log.exists():
            for line in log.read_text().splitlines():
                entry = json.loads(line)
                self._count(entry["kind"], entry["tried"], entry["wrong"])

    def enter(self, kind: str, complaints: list[str], case: str = "", tried: int = 1) -> None:
        """So many cases of a kind were tried; complaints are what was wrong with one of them."""
        self._count(kind, tried, complaints)
        if complaints:
            print(f"WRONG {kind}: {case}: {'; '.join(complaints)}", flush=True)
        if self._log is not None:
            with self._log.open("a") as log:
                log.write(json.dumps({"kind": kind, "tried": tried, "case": case, "wrong": complaints}) + "\n")

    def table(self) -> str:
        """Tried and wrong, a line for each kind."""
        width = max(map(len, self.tried), default=4)
        rows = [f"{'kind':{width}}   tried   wrong"]
        rows += [f"{kind:{width}} {self.tried[kind]:7} {self.wrong[kind]:7}" for kind in sorted(self.tried)]
        return "\n".join(rows)

    def _count(self, kind: str, tried: int, complaints: list[str]) -> None:
        self.tried[kind] += tried
        self.wrong[kind] += bool(complaints)
