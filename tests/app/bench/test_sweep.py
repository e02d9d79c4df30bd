"""`riseg bench --sweep`: other images and other numbers of things, all else the same."""

import json

import numpy as np
import pytest
from rich.console import Console

from riseg_drake.app.bench import sweep
from riseg_drake.app.bench.pair_times import FLOW, MOVING, STILL
from riseg_drake.app.bench.sweep import CASES, Case, _FrameClock, scenario_of, sweep_command
from riseg_drake.app.cli import main
from riseg_drake.app.scenario import load_scenario
from riseg_drake.geometry.camera import rays


@pytest.mark.parametrize("case", CASES, ids=lambda case: case.name)
def test_images_of_any_size_show_the_same_from_top_to_bottom(case):
    camera = load_scenario(None).station.camera
    other = scenario_of(load_scenario(None), case).station.camera
    assert (other.width, other.height) == (case.width, case.height)
    finer = case.height / 480
    # The outer edges of the first and the last row, and what lies in the middle of a row.
    edges = (np.array([-0.5, 479.5]) - camera.cy) / camera.fy
    assert (np.array([-0.5, case.height - 0.5]) - other.cy) / other.fy == pytest.approx(edges)
    assert ((case.width - 1) / 2 - other.cx) / other.fx == pytest.approx((319.5 - camera.cx) / camera.fx)
    assert other.fx / other.fy == pytest.approx(camera.fx / camera.fy)
    assert rays(other.intrinsics).shape == (case.height, case.width, 3)
    assert other.fx == pytest.approx(finer * camera.fx)


def test_a_case_has_its_number_of_things_on_as_much_table_for_each():
    scenario = load_scenario(None)
    few, many = (scenario_of(scenario, Case(640, 480, n)).station.scene for n in (2, 24))
    assert (few.count_min, few.count_max, few.layout, few.radius) == (2, 2, "spread", None)
    assert (many.count_min, many.count_max, many.layout) == (24, 24, "crowd")
    assert many.radius == pytest.approx(0.30)
    assert scenario.station.scene.count_max is None


def test_a_frame_takes_what_all_stages_but_the_planner_take_each_once():
    clock = _FrameClock()
    clock.measure("MaskPropagator", lambda: [clock.measure("OpticalFlow", lambda: None), clock.seconds])
    clock.measure("PushPlanner", lambda: None)
    alg_2 = clock.seconds["MaskPropagator"] + clock.seconds["OpticalFlow"]
    assert clock.frame == pytest.approx(sum(alg_2), abs=1e-12)


@pytest.mark.renders
def test_every_pair_of_every_case_is_in_the_table_and_in_the_file(
    small_scenario, tmp_path, monkeypatch, capsys
):
    monkeypatch.setattr(sweep, "PUSHES", 1)
    file, cases = tmp_path / "sweep.json", (Case(160, 120, 2), Case(320, 240, 2))
    sweep_command(small_scenario, 1, file, Console(width=200), cases)
    told, printed = json.loads(file.read_text()), capsys.readouterr().out
    assert list(told["cases"]) == [case.name for case in cases]
    for case in cases:
        row = told["cases"][case.name]
        pairs = row["pairs"]
        assert (row["width"], row["height"], row["objects"]) == (case.width, case.height, case.objects)
        assert pairs[MOVING]["calls"] > 10
        assert pairs[FLOW]["calls"] == pairs[MOVING]["calls"] + pairs[STILL]["calls"]
        line = next(line for line in printed.splitlines() if line.strip().startswith(case.name))
        assert f"{pairs[MOVING]['median_ratio']:.1f}" in line.split()


@pytest.mark.renders
def test_a_case_that_the_models_do_not_suffice_for_is_left_out_and_told(small_scenario, tmp_path, capsys):
    file = tmp_path / "sweep.json"
    sweep_command(small_scenario, 1, file, Console(width=200), (Case(160, 120, 99),))
    assert json.loads(file.read_text())["cases"] == {}
    assert "160x120, 99 objects left out: " in capsys.readouterr().out


def test_only_one_thing_is_measured_at_a_time(capsys):
    with pytest.raises(SystemExit):
        main(["bench", "--sweep", "--run"])
    assert "not allowed with argument" in capsys.readouterr().err
