"""The fault trial: what was tried, and what went wrong, by kind.

python -m tests.faults stops --commands run segment evaluate hardware --signals INT KILL --count 30
python -m tests.faults inputs --count 20000
python -m tests.faults machine
python -m tests.faults long --minutes 20

With --log FILE what was found is kept, and the next part is added to it.
"""

import argparse
import tempfile
from pathlib import Path

from tests.faults.tally import Tally

COMMANDS = ["run", "segment", "evaluate", "hardware"]
KINDS = ["idle", "busy"]


def main() -> int:
    """Run a part; 0 if nothing was wrong."""
    parser = argparse.ArgumentParser(prog="python -m tests.faults", description=__doc__.splitlines()[0])
    parser.add_argument("--log", type=Path, help="keep results here, and add to those that are there")
    parts = parser.add_subparsers(dest="part", required=True)
    stops = parts.add_parser("stops", help="commands stopped at random moments")
    stops.add_argument("--signals", nargs="+", default=["INT", "TERM", "KILL", "STOP"])
    stops.add_argument("--count", type=int, default=3, help="of each signal (3)")
    stops.add_argument("--place", type=Path, help="folder to work in (a new one)")
    inputs = parts.add_parser("inputs", help="mutated files and messages for every reader")
    inputs.add_argument("--readers", nargs="+", help="(all)")
    inputs.add_argument("--count", type=int, default=200, help="over all readers (200)")
    long = parts.add_parser("long", help="arm and camera for a long time: memory, and gaps between commands")
    long.add_argument("--minutes", type=float, default=20.0, help="of each kind (20)")
    long.add_argument("--kinds", nargs="+", choices=KINDS, default=KINDS)
    long.add_argument("--place", type=Path, help="folder to work in (a new one)")
    machine = parts.add_parser("machine", help="full and read-only disks, no shared memory, clocks set")
    for part in (stops, machine):
        part.add_argument("--commands", nargs="+", choices=COMMANDS, default=COMMANDS)
    for part in (stops, inputs):
        part.add_argument("--seed", type=int, default=0, help="draws moments and mutations (0)")
    chosen = parser.parse_args()
    tally = Tally(chosen.log)
    if chosen.part == "stops":
        from tests.faults.stops import try_stops

        try_stops(chosen.commands, chosen.signals, chosen.count, chosen.seed, tally, chosen.place)
    elif chosen.part == "long":
        from tests.faults.endurance import try_endurance

        place = chosen.place or Path(tempfile.mkdtemp(prefix="riseg_faults_"))
        try_endurance(chosen.minutes, chosen.kinds, tally, place)
    elif chosen.part == "inputs":
        from tests.faults.inputs import try_inputs

        try_inputs(chosen.readers, chosen.count, chosen.seed, tally)
    else:
        from tests.faults.machine import try_machine

        try_machine(chosen.commands, tally)
    print(tally.table())
    return 1 if any(tally.wrong.values()) else 0


if __name__ == "__main__":
    raise SystemExit(main())
