import os
from dataclasses import dataclass, field

import pytest

from riseg_drake.app.scenario import Scenario
from riseg_drake.app.scenario_file import ScenarioError, parse_scenario, read_scenario


@dataclass
class Camera:
    rate: float = 15.0
    noise: bool = True


@dataclass
class Sensor:
    gain: float = 1.0


@dataclass
class Scene:
    camera: Camera = field(default_factory=Camera)
    objects: int = 4
    name: str = "built-in"
    centre: list[float] = field(default_factory=lambda: [0.5, 0.0])
    limit: float | None = None
    method: str = field(default="fast", metadata={"choices": ("fast", "careful")})
    eye: Camera | Sensor = field(default_factory=Camera)


def parse(text):
    return parse_scenario(text, Scene, source="scene.yaml")


def test_absent_keys_keep_their_defaults():
    scene = parse("camera: {rate: 30}\nlimit: 1e-3")
    assert scene == Scene(camera=Camera(rate=30.0), limit=0.001)


@pytest.mark.parametrize("text", ["", "# only a comment\n", "{}"])
def test_an_empty_file_is_all_defaults(text):
    assert parse(text) == Scene()


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("objetcs: 4", "scene.yaml: line 1: unknown key 'objetcs'; did you mean 'objects'?"),
        (
            "objects: 4\ncamera:\n  xyz: 1",
            "scene.yaml: line 3: unknown key 'camera.xyz'; the keys here are rate, noise",
        ),
        ("camera: {rate: fast}", "scene.yaml: line 1: camera.rate must be a number, not 'fast'"),
        ("camera: {rate: .nan}", "scene.yaml: line 1: camera.rate must be a number, not '.nan'"),
        ("objects: 4.5", "scene.yaml: line 1: objects must be a whole number, not '4.5'"),
        ("camera: {noise: 1}", "scene.yaml: line 1: camera.noise must be true or false, not '1'"),
        ("name: 3", "scene.yaml: line 1: name must be a text (a number is one in quotes), not '3'"),
        ("centre: 3", "scene.yaml: line 1: centre must be a list, such as [1, 2], not '3'"),
        ("centre: [1, x]", "scene.yaml: line 1: centre[1] must be a number, not 'x'"),
        ("camera: 3", "scene.yaml: line 1: camera must be a block of keys (rate, noise), not '3'"),
        ("eye:", "scene.yaml: line 1: eye must be a block of keys (rate, noise), not ''"),
        ("method: quick", "scene.yaml: line 1: method must be one of fast, careful, not 'quick'"),
        ("- 1", "scene.yaml: line 1: the scenario must be a block of keys"),
        ("a: [1", "scene.yaml: line 1: not YAML"),
        ("objects: 4\n\nobjects: 5", "scene.yaml: line 3: 'objects' stands twice, in line 1 too"),
        ("camera: {rate: 1, rate: 2}", "scene.yaml: line 1: 'camera.rate' stands twice, in line 1 too"),
    ],
)
def test_an_error_says_in_one_line_where_it_is_and_what_would_have_been_right(text, message):
    with pytest.raises(ScenarioError) as error:
        parse(text)
    assert str(error.value).startswith(message)
    assert "\n" not in str(error.value)


@dataclass
class Lens:
    shares: list[float] = field(default_factory=lambda: [0.5, 0.5], metadata={"sizes": (0, 2), "least": 0.0})
    near: float = field(default=0.3, metadata={"least": 0.1, "most": 2.0})
    far: float | None = field(default=None, metadata={"most": 9.0})

    def check(self):
        if self.far is not None and self.far <= self.near:
            raise ValueError(f"far is {self.far:g}; more than near, {self.near:g} m")


@dataclass
class Bench:
    lens: Lens = field(default_factory=Lens)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("lens:\n  near: 3", "bench.yaml: line 2: lens.near is 3; expected 0.1 to 2"),
        ("lens:\n  far: 10", "bench.yaml: line 2: lens.far is 10; expected at most 9"),
        ("lens:\n  shares: [0.1, -2]", "bench.yaml: line 2: lens.shares is -2; expected at least 0"),
        ("lens:\n  shares: [1]", "bench.yaml: line 2: lens.shares has 1 numbers; expected 0 or 2"),
        ("lens:\n  near: 1\n  far: 0.5", "bench.yaml: line 3: lens.far is 0.5; more than near, 1 m"),
    ],
)
def test_a_value_out_of_bounds_is_named_with_key_value_and_bound(text, message):
    with pytest.raises(ScenarioError) as error:
        parse_scenario(text, Bench, source="bench.yaml")
    assert str(error.value) == message


def test_values_within_bounds_are_taken():
    lens = parse_scenario("lens: {near: 0.1, far: 9, shares: []}", Bench, source="bench.yaml").lens
    assert (lens.near, lens.far, lens.shares) == (0.1, 9.0, [])


def test_a_missing_file_is_named_with_its_nearest_neighbour(tmp_path):
    (tmp_path / "simulation.yaml").write_text("")
    with pytest.raises(ScenarioError, match=r"simulatoin.yaml is not there; did you mean .*simulation.yaml\?"):
        read_scenario(tmp_path / "simulatoin.yaml", Scene)
    with pytest.raises(ScenarioError, match="nor is the folder"):
        read_scenario(tmp_path / "nowhere" / "x.yaml", Scene)


def test_a_file_that_is_no_text_is_refused(tmp_path):
    (tmp_path / "x.yaml").write_bytes(b"\xff\xfe\x00")
    with pytest.raises(ScenarioError, match="not a readable text file"):
        read_scenario(tmp_path / "x.yaml", Scene)
    with pytest.raises(ScenarioError, match="a folder, not a file"):
        read_scenario(tmp_path, Scene)


@dataclass
class Drawn:
    seed: int = 0


@dataclass
class Real:
    url: str = "here"
    camera: Camera = field(default_factory=Camera)


@dataclass
class Either:
    station: Drawn | Real = field(default_factory=Drawn)


def test_a_tag_chooses_between_kinds_and_the_first_needs_none():
    def either(text):
        return parse_scenario(text, Either, source="either.yaml").station

    assert either("station: {seed: 3}") == Drawn(seed=3)
    assert either("station: !Real {camera: {rate: 5}}") == Real(camera=Camera(rate=5.0))
    assert either("{}") == Drawn()


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("station: !Reel {}", r"station must be one of !Drawn, !Real, not !Reel"),
        ("station: !Real {camera: {rat: 5}}", r"unknown key 'station.camera.rat'; did you mean 'rate'"),
        (
            "station: {url: there}",
            r"line 1: 'station.url' is a key of !Real, and station has not that tag: write `station: !Real`",
        ),
        ("station: !Real {seed: 3}", r"'station.seed' is a key of !Drawn"),
        ("station: {uri: there}", r"unknown key 'station.uri'"),
    ],
)
def test_a_kind_is_checked_as_what_it_is(text, message):
    with pytest.raises(ScenarioError, match=message):
        parse_scenario(text, Either, source="either.yaml")


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("[" * 100_000, "line 1: nothing in a scenario is nested so deeply"),
        ("a: [" + "1, " * 100_000, "line 1: a scenario has no more than 20000 keys and values"),
        ("{a: " * 100_000, "line 1: nothing in a scenario is nested so deeply"),
        ("%YAML 1.1\n---\nlongest: 3", "no directives"),
        ("%TAG !! tag:x,2000:\n---\nlongest: 3", "no directives"),
        ("longest: !seconds 3", "longest has the unknown tag !seconds"),
        ("longest: !<tag:x.org,2000:y> 3", "longest has the unknown tag tag:x.org,2000:y"),
        ("longest: !!python/object/apply:os.system [x]", "unknown tag"),
        ("longest: !!timestamp 3", "scenario.yaml"),
        ("arm: {most_interactions: !!int x}", "scenario.yaml"),
        ("--- {}\n--- {}", "not YAML"),
        ("longest: \x00", "not YAML"),
        ("? {}\n: 3", "scenario.yaml"),
        ("? [a]\n: 3", "scenario.yaml"),
    ],
)
def test_yaml_that_no_scenario_needs_is_one_line(tmp_path, text, says):
    from riseg_drake.app.scenario import load_scenario

    (tmp_path / "scenario.yaml").write_text(text)
    with pytest.raises(ScenarioError) as error:
        load_scenario(tmp_path / "scenario.yaml")
    assert says in str(error.value)
    assert "\n" not in str(error.value)


def test_a_pipe_in_the_place_of_a_scenario_hangs_nobody(tmp_path):
    os.mkfifo(tmp_path / "x.yaml")
    with pytest.raises(ScenarioError, match="a pipe, not a file; a scenario is a YAML file"):
        read_scenario(tmp_path / "x.yaml", Scene)


FORMER = "station: {{panda: {{pusher_url: 'package://riseg_drake_models/pusher/{file}.sdf'}}}}"


@pytest.mark.parametrize(
    "text",
    [
        FORMER.format(file="pusher"),
        FORMER.format(file="bar"),
        "push: {action: {pusher: {thickness: 0.02, width: 0.03, length: 0.3}}}",
    ],
)
def test_what_recordings_say_of_the_bar_by_its_former_keys_is_todays_default(text):
    read, default = parse_scenario(text, Scenario, source="run.yaml"), Scenario()
    assert read.station.panda == default.station.panda
    assert read.push.action.pusher == default.push.action.pusher


@pytest.mark.parametrize("text", [FORMER.format(file="mine"), "push: {action: {pusher: {width: 0.04}}}"])
def test_another_tool_by_its_former_keys_is_refused(text):
    with pytest.raises(ScenarioError, match="unknown key"):
        parse_scenario(text, Scenario, source="run.yaml")
