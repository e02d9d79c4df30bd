"""The process that is given mutated inputs: `python -m tests.faults.reading READER SEED FIRST END PLACE`."""

import contextlib
import io
import json
import os
import random
import sys
import time
import traceback
from pathlib import Path

from riseg_drake.host.processes import end_with_parent
from tests.faults.readers import READERS, Reader, prepared


def main() -> None:
    """Read the right input, then the mutated ones; say of each what became of it, a JSON object a line."""
    end_with_parent(os.getppid())
    name, seed, first, end, place = sys.argv[1], *map(int, sys.argv[2:5]), Path(sys.argv[5])
    out = os.fdopen(os.dup(1), "w", buffering=1)
    os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
    for case in (-1, *range(first, end)):
        prepared(READERS[name], place / "work")
        what = "right"
        if case >= 0:
            what = READERS[name].mutate(place / "work", random.Random(f"{name} {seed} {case}"))
        out.write(json.dumps({"begins": case, "what": what}) + "\n")
        out.write(json.dumps({"case": case, "what": what, **_read(READERS[name], place / "work")}) + "\n")


def _read(reader: Reader, place: Path) -> dict:
    Path("/proc/self/clear_refs").write_text("5")  # the peak of memory begins anew
    errors, complaints, code, start = io.StringIO(), [], -1, time.process_time()
    with contextlib.redirect_stderr(errors), contextlib.redirect_stdout(io.StringIO()):
        try:
            code = reader.read(place)
        except BaseException:
            complaints.append(traceback.format_exc()[-700:])
    seconds = time.process_time() - start
    said = errors.getvalue()
    if code not in (0, 2) and not complaints:
        complaints.append(f"exit code {code}")
    if "Traceback" in said or said.count("\n") > 1 or len(said) > 2000:
        complaints.append(f"said {said[-500:]!r}")
    status = Path("/proc/self/status").read_text()
    peak = next(line for line in status.splitlines() if line.startswith("VmHWM")).split()[1]
    memory = int(peak) // 1024
    return {"code": code, "error": said, "complaints": complaints, "memory_mb": memory, "seconds": seconds}


if __name__ == "__main__":
    main()
