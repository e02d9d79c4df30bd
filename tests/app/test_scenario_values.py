"""What a robot cannot do, or nobody should ask of it, is refused before anything moves."""

import dataclasses

import numpy as np
import pytest

from riseg_drake.app.scenario import BUILT_IN, HARDWARE, Scenario, load_scenario
from riseg_drake.app.scenario_file import ScenarioError, parse_scenario
from riseg_drake.stations.hardware import HardwareStationConfig
from riseg_drake.stations.scene import SceneConfig
from riseg_drake.stations.sensor_noise import SensorNoise
from riseg_drake.stations.simulated import SimulatedStationConfig
from riseg_drake.stations.smooth_error import SmoothErrorParameters


def refusal(station, kind="!HardwareStationConfig"):
    """What is said to a station's YAML."""
    with pytest.raises(ScenarioError) as error:
        parse_scenario(f"station: {kind}\n  {station}", Scenario, source="x.yaml")
    assert "\n" not in str(error.value)
    return str(error.value).removeprefix("x.yaml: line ")


@pytest.mark.parametrize("name", [BUILT_IN, HARDWARE])
def test_the_built_in_scenarios_are_within_bounds(name):
    load_scenario(None, name)


@pytest.mark.parametrize("share", ["velocity", "acceleration", "jerk", "stop_acceleration", "stop_jerk"])
@pytest.mark.parametrize("value", ["3.0", "1.0001", "0", "-0.1"])
def test_more_than_the_robots_limits_or_nothing_is_refused(share, value):
    said = refusal(f"command: {{limits: {{{share}: {value}}}}}")
    assert said.startswith(f"2: station.command.limits.{share} is {float(value):g}; expected a share")


@pytest.mark.parametrize(
    ("station", "said"),
    [
        (
            "command: {limits: {position_margin: -1}}",
            "command.limits.position_margin is -1; expected 0.005",
        ),
        ("command: {limits: {stop_jerk: 0.1}}", "command.limits.stop_jerk is 0.1; at least jerk, 0.25"),
        ("command: {limits: {velocity: 1}}", "command.limits: a stop from full speed would take"),
        ("command: {rate: 10}", "command.rate is 10; expected 100 to 1000"),
        (
            "command: {safety: {status_age: 1e9}}",
            "command.safety.status_age is 1e+09; expected 0.02 to 0.3",
        ),
        ("command: {safety: {status_gap: 9}}", "command.safety.status_gap is 9; expected"),
        ("command: {safety: {image_age: 1e9}}", "command.safety.image_age is 1e+09; expected"),
        (
            "command: {safety: {contact_force: 1e9}}",
            "command.safety.contact_force is 1e+09; expected 1 to 100",
        ),
        ("command: {safety: {push_force: -5}}", "command.safety.push_force is -5; expected 1 to 100"),
        (
            "command: {safety: {push_force: 10}}",
            "command.safety.contact_force is 15; at most push_force, 10",
        ),
        (
            "command: {safety: {largest_gap: 3}}",
            "command.safety.largest_gap is 3; expected 0.01 to 0.3",
        ),
        (
            "command: {safety: {workspace_lower: [0, 0]}}",
            "command.safety.workspace_lower has 2 numbers",
        ),
        (
            "command: {safety: {workspace_lower: [0, .nan, 0]}}",
            "command.safety.workspace_lower[1] must be a",
        ),
        (
            "command: {safety: {workspace_upper: [0, 9, 0]}}",
            "command.safety.workspace_upper is 9; expected -2",
        ),
        (
            "command: {safety: {workspace_upper: [0.8, 0.6, 0]}}",
            "command.safety.workspace_lower is [0.15",
        ),
        ("command: {playout: {delay: 1e9}}", "command.playout.delay is 1e+09; expected 0.05 to 5"),
        ("panda: {X_EC: [1, 2]}", "panda.X_EC has 2 numbers; expected 0 or 6"),
        (
            "panda: {X_EC: [40, 0, 0, 0, 0, 0]}",
            "panda.X_EC is [40.0, 0.0, 0.0, 0.0, 0.0, 0.0]; x, y, z are",
        ),
        ("panda: {robot: fr4}", "panda.robot must be one of panda, fr3"),
        ("start_position: [0, 0, 0]", "start_position has 3 numbers; expected 0 or 7"),
        ("start_position: [0, 0, 0, 1, 0, 1, 0]", "start_position is 1 for joint 4; expected"),
        ("camera: {rate: 0}", "camera.rate is 0; expected 0.5 to 120"),
        ("camera: {full_width: 10000000}", "camera.full_width is 1e+07; expected 16 to 16384"),
        ("camera: {width: 900}", "camera.width is 900; at most full_width, 848 px"),
        ("camera: {fx: -600}", "camera.fx is -600; expected"),
        ("camera: {cx: 900}", "camera.cx is 900; expected a pixel of the picture, 0 to 847"),
        ("camera: {depth_min: 4}", "camera.depth_min is 4; less than depth_max, 3 m"),
        ("camera: {latency: -1}", "camera.latency is -1; expected 0 to 1"),
        (
            "lcm: {status_channel: PANDA_COMMAND}",
            "lcm.command_channel is 'PANDA_COMMAND', as status_channel is",
        ),
        ("lcm: {camera_serial: ''}", "lcm.camera_serial is ''; expected 1 to 38 letters"),
    ],
)
def test_a_value_that_cannot_be_is_named_with_its_bound(station, said):
    assert refusal(station).startswith(f"2: station.{said}")


def test_the_range_is_that_of_the_robot_that_is_named():
    posture = "[0, 0, 0, -1.5, 0, 0.3, 0]"  # joint 6 of a Panda, and not of an FR3
    parse_scenario(f"station: !HardwareStationConfig\n  start_position: {posture}", Scenario, source="x.yaml")
    said = refusal(f"start_position: {posture}\n  panda: {{robot: fr3}}")
    assert said.startswith("2: station.start_position is 0.3 for joint 6; expected 0.5709 to ")


@pytest.mark.parametrize(
    ("station", "said"),
    [
        ("camera: {width: 3}", "camera.width is 3; expected 16 to 16384"),
        ("observe_pitch: 45", "observe_pitch is 45; expected 0 to 1.2"),
        ("observe_pitch: -0.785", "observe_pitch is -0.785; expected 0 to 1.2"),
        ("observe_height: -0.5", "observe_height is -0.5; expected 0.1 to 1.5"),
        ("camera: {mount_turn: [0.1]}", "camera.mount_turn has 1 numbers; expected 3"),
        ("camera: {mount_shift: [2, 0, 0]}", "camera.mount_shift is 2; expected -0.1 to 0.1"),
        (
            "camera: {noise: {smooth: {disparity_std: -1}}}",
            "camera.noise.smooth.disparity_std is -1; expected 0",
        ),
        ("camera: {noise: {flying: 1.5}}", "camera.noise.flying is 1.5; expected 0 to 1"),
        ("camera: {noise: {grazing_angle: 1.2}}", "camera.noise.grazing_angle is 1.2; expected 2 to 89"),
        ("camera: {noise: {depth_shift: [1]}}", "camera.noise.depth_shift has 1 numbers; expected 2"),
        ("table: {color: [200, 200, 200]}", "table.color is 200; expected 0 to 1"),
        ("scene: {count_min: 5, count_max: 3}", "scene.count_min, count_max: 5, 3; expected 1 <= min <= max"),
    ],
)
def test_a_simulated_station_is_checked_too(station, said):
    assert refusal(station, kind="!SimulatedStationConfig").startswith(f"2: station.{said}")


@pytest.mark.parametrize("schema", [SensorNoise, SmoothErrorParameters])
def test_every_number_of_the_sensors_errors_has_bounds_around_its_default(schema):
    for field in dataclasses.fields(schema):
        values = np.ravel(getattr(schema(), field.name))
        if field.type is not bool and values.dtype.kind in "if":
            assert np.all((field.metadata["least"] <= values) & (values <= field.metadata["most"])), field.name


@pytest.mark.parametrize("name", ["centre_W", "observe_height", "observe_pitch"])
def test_a_simulated_arm_looks_from_where_a_real_one_may(name):
    real = {field.name: field.metadata for field in dataclasses.fields(HardwareStationConfig)}[name]
    holder = SceneConfig if name == "centre_W" else SimulatedStationConfig
    assert {field.name: field.metadata for field in dataclasses.fields(holder)}[name] == real
