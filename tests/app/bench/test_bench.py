"""`riseg bench`: the figures that it prints are those that it writes."""

import json

import pytest

from riseg_drake.app.bench import command
from riseg_drake.app.bench.pair_times import FLOW, MOVING, STILL
from riseg_drake.app.cli import main

pytestmark = pytest.mark.renders

STAGES = ("FrameView", "ObjectsAboveTable", "ExpectedFlow", "OpticalFlow", "BFIFGrouper", "MaskPropagator")


def test_every_pair_of_a_push_is_timed_and_its_flow_beside_it(small_scenario, tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(command, "REPETITIONS", 1)
    file = tmp_path / "bench.json"
    assert main(["bench", str(small_scenario), "--seed", "1", "--json", str(file)]) == 0
    written, printed = json.loads(file.read_text()), capsys.readouterr().out
    pairs, stages = written["pairs"], written["stages"]
    calls = {name: each["calls"] for name, each in pairs.items()}
    assert calls[MOVING] > 10
    rows = {line.split()[0] for line in printed.splitlines() if line.strip()}
    assert rows >= {*STAGES, "pair,", "DIS"}
    assert calls[FLOW] == calls[MOVING] + calls.get(STILL, 0) == stages["BFIFGrouper"]["calls"]
    assert f"{pairs[MOVING]['median_ratio']:.1f}, {pairs[MOVING]['p95_ratio']:.1f} and" in printed
    # Stages do not work twice at once: together they take no longer than whole pairs.
    whole = sum(pairs[name]["calls"] * pairs[name]["longest_ms"] for name in (MOVING, STILL) if name in pairs)
    assert sum(each["calls"] * each["median_ms"] for each in stages.values()) < whole
    assert written["seed"] == 1
    assert all(each["peak_mb"] >= 0 for each in stages.values())
