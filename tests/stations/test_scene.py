import itertools
from pathlib import Path

import numpy as np
import pytest
from pydrake.geometry import (
    ClippingRange,
    ColorRenderCamera,
    DepthRange,
    DepthRenderCamera,
    RenderCameraCore,
    RenderEngineVtkParams,
)
from pydrake.math import RigidTransform, RollPitchYaw, RotationMatrix
from pydrake.multibody.plant import AddMultibodyPlantSceneGraph
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.sensors import CameraInfo, RgbdSensor

from riseg_drake.app.scenario import load_scenario
from riseg_drake.stations import scene as scene_module
from riseg_drake.stations.footprint import Footprint, separation, travel
from riseg_drake.stations.layouts import lay_out
from riseg_drake.stations.object_models import SceneError, find_model, find_models
from riseg_drake.stations.placed_object import PlacedObject, add_scene, object_id_table
from riseg_drake.stations.render_engine import make_render_engine
from riseg_drake.stations.scene import PlacedConfig, SceneConfig, draw_scene, make_scene
from riseg_drake.stations.settling import SettlingTable, is_pile, settle
from tests.stations.resting_layouts import KINDS, lying, packed

SEEDS = range(6)
INERTIAL = (
    "<inertial><mass>0.1</mass><inertia><ixx>6e-5</ixx><iyy>6e-5</iyy><izz>7e-5</izz></inertia></inertial>"
)


def sdf(
    geometry: str, pose: str = "0 0 0 0 0 0", more: str = "", visual: str = "", inertial: str = INERTIAL
) -> str:
    collision = f'<collision name="c"><geometry>{geometry}</geometry></collision>' if geometry else ""
    seen = visual or f'<visual name="v"><geometry>{box(0.01, 0.01, 0.01)}</geometry></visual>'
    return (
        f'<sdf version="1.9"><model name="m"><pose>{pose}</pose>'
        f'<link name="b">{inertial}{collision}{seen}</link>{more}</model></sdf>'
    )


def box(x: float, y: float, z: float) -> str:
    return f"<box><size>{x} {y} {z}</size></box>"


def write_plain_models(folder: Path) -> None:
    (folder / "brick.sdf").write_text(sdf(box(0.08, 0.05, 0.04)))
    (folder / "slab.sdf").write_text(sdf(box(0.09, 0.04, 0.015)))
    (folder / "lying.sdf").write_text(sdf(box(0.04, 0.05, 0.08), pose="0 0 0.3 1.5707963 0 0"))
    (folder / "can").mkdir()
    (folder / "can" / "model.sdf").write_text(
        sdf("<cylinder><radius>0.03</radius><length>0.05</length></cylinder>")
    )
    (folder / "dice.urdf").write_text(
        '<robot name="dice"><link name="d"><inertial><mass value="0.1"/>'
        '<inertia ixx="6e-5" iyy="6e-5" izz="7e-5" ixy="0" ixz="0" iyz="0"/></inertial>'
        '<collision><geometry><box size="0.05 0.05 0.05"/></geometry></collision>'
        '<visual><geometry><box size="0.05 0.05 0.05"/></geometry></visual></link></robot>'
    )


def draw(seed: int, **options) -> list[PlacedObject]:
    return draw_scene(SceneConfig(**options), np.random.default_rng(seed))


def distances(scene: list[PlacedObject]) -> list[float]:
    return [separation(a, b) for a, b in itertools.combinations(map(lying, scene), 2)]


@pytest.fixture(scope="module")
def scenes() -> list[list[PlacedObject]]:
    return [draw(seed) for seed in SEEDS]


def test_a_shape_travels_until_its_corner_meets_an_edge():
    square = np.array([[0, 0], [1, 0], [1, 1], [0, 1.0]])
    left = Footprint((square,), 0.0)
    right = left.moved(0.0, np.array([3.0, 0.5]))
    assert travel(left, right, np.array([1.0, 0.0])) == pytest.approx(2.0)
    assert travel(right, left, np.array([-1.0, 0.0])) == pytest.approx(2.0)
    assert travel(left, right, np.array([0.0, 1.0])) == np.inf
    assert separation(left, right) == pytest.approx(2.0)
    assert separation(left, left.moved(0.0, np.array([1.3, 1.4]))) == pytest.approx(0.5)
    assert separation(left, left.moved(0.0, np.array([0.9, 0.9]))) == 0.0


@pytest.mark.renders
def test_a_scene_has_four_to_six_different_objects(scenes):
    counts = [len(scene) for scene in scenes]
    assert min(counts) >= 4
    assert max(counts) <= 6
    assert len(set(counts)) > 1
    assert all(len({item.name for item in scene}) == len(scene) for scene in scenes)


@pytest.mark.renders
def test_nothing_overlaps_and_in_every_scene_something_touches(scenes):
    for scene in scenes:
        gaps = distances(scene)
        assert min(gaps) > 0
        assert sum(gap < 0.003 for gap in gaps) >= 1
    assert np.mean([sum(gap < 0.003 for gap in distances(scene)) for scene in scenes]) >= 2


@pytest.mark.renders
def test_every_object_lies_inside_the_work_area(scenes):
    for item in itertools.chain(*scenes):
        assert np.linalg.norm(lying(item).corners() - (0.5, 0.0), axis=1).max() < 0.15


@pytest.mark.renders
def test_every_object_stands_level_on_the_table(scenes):
    for item in itertools.chain(*scenes):
        assert item.X_WB.rotation().matrix()[2, 2] > np.cos(np.radians(0.1))
        assert item.X_WB.translation()[2] == pytest.approx(-item.model.footprint.bottom, abs=1e-4)


@pytest.mark.renders
def test_the_same_seed_gives_the_same_scene_to_the_last_bit(scenes):
    again = draw(SEEDS[1])
    assert [item.name for item in again] == [item.name for item in scenes[1]]
    for item, before in zip(again, scenes[1], strict=True):
        assert np.array_equal(item.X_WB.GetAsMatrix4(), before.X_WB.GetAsMatrix4())


@pytest.mark.renders
def test_different_seeds_give_different_scenes(scenes):
    assert len({tuple(item.name for item in scene) for scene in scenes}) == len(scenes)


def test_objects_can_be_chosen_by_name():
    scene = draw(0, names=["zebra", "cookie"], count_min=2, count_max=2)
    assert sorted(item.name for item in scene) == ["cookie", "zebra"]


def test_a_folder_of_plain_models_makes_a_scene(tmp_path):
    write_plain_models(tmp_path)
    scene = draw(3, objects=str(tmp_path), count_min=5, count_max=5)
    assert {item.name for item in scene} == {"brick", "can", "dice", "lying", "slab"}
    assert min(distances(scene)) > 0
    height = {item.name: item.X_WB.translation()[2] for item in scene}
    for name, half in {
        "brick": 0.02,
        "slab": 0.0075,
        "lying": 0.025,
        "can": 0.025,
        "dice": 0.025,
    }.items():
        assert height[name] == pytest.approx(half, abs=1e-4)


def test_object_ids_count_the_bodies_in_the_order_of_the_scene():
    scene = draw(0, names=["fish", "pizza", "starfish"], count_min=3, count_max=3)
    plant, scene_graph = AddMultibodyPlantSceneGraph(DiagramBuilder(), 0.002)
    bodies = add_scene(plant, scene_graph, scene)
    plant.Finalize()
    context = plant.CreateDefaultContext()
    assert list(bodies) == [1, 2, 3]
    for item, body in zip(scene, bodies.values(), strict=True):
        assert plant.get_body(body).name() == item.name
        assert plant.get_body(body).EvalPoseInWorld(context).IsNearlyEqualTo(item.X_WB, 1e-12)
    table = object_id_table(bodies)
    assert [table[int(body)] for body in bodies.values()] == [1, 2, 3]
    assert table.sum() == 6


@pytest.mark.renders
def test_every_object_shows_in_the_label_image_of_a_camera_half_a_metre_up(scenes):
    builder = DiagramBuilder()
    plant, scene_graph = AddMultibodyPlantSceneGraph(builder, 0.002)
    scene_graph.AddRenderer("vtk", make_render_engine(RenderEngineVtkParams()))
    bodies = add_scene(plant, scene_graph, scenes[0])
    plant.Finalize()
    core = RenderCameraCore(
        "vtk",
        CameraInfo(640, 480, 616.0, 616.0, 319.5, 239.5),
        ClippingRange(0.01, 5.0),
        RigidTransform(),
    )
    X_WC = RigidTransform(RotationMatrix.MakeXRotation(np.pi), [0.5, 0.0, 0.5])
    sensor = builder.AddSystem(
        RgbdSensor(
            scene_graph.world_frame_id(),
            X_WC,
            ColorRenderCamera(core),
            DepthRenderCamera(core, DepthRange(0.1, 3.0)),
        )
    )
    builder.Connect(scene_graph.get_query_output_port(), sensor.query_object_input_port())
    diagram = builder.Build()
    context = sensor.GetMyContextFromRoot(diagram.CreateDefaultContext())
    image = object_id_table(bodies)[sensor.label_image_output_port().Eval(context).data[..., 0]]
    assert set(np.unique(image)) == {0, *bodies}
    border = np.concatenate([image[0], image[-1], image[:, 0], image[:, -1]])
    assert not border.any()


@pytest.mark.renders
@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"count_min": 5, "count_max": 4}, "1 <= min <= max"),
        ({"count_min": 40, "count_max": 50}, "40 different objects wanted"),
        ({"radius": 0.07}, "do not fit within 0.07 m"),
        ({"radius": -1.0}, "radius"),
        ({"names": ["unicorn"]}, "no model unicorn"),
        ({"touch_probability": 2.0}, "0 to 1"),
        ({"objects": "no/such/folder"}, "not a folder"),
        ({"objects": "package://nobody/objects"}, "nobody"),
    ],
)
def test_an_impossible_scene_says_in_one_line_what_is_wrong(options, message):
    with pytest.raises(SceneError, match=message) as error:
        draw(0, **options)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (None, "no models in"),
        (sdf(box(0.05, 0.05, 0.05), more=f'<link name="second">{INERTIAL}</link>'), "2 bodies"),
        (sdf(""), "no collision geometry"),
        (sdf(box(0.05, 0.05, 0.05), more="<static>true</static>"), "fixed to the world"),
        (sdf("<plane><normal>0 0 1</normal></plane>"), "half space"),
        (sdf(box(0.05, 0.05, 0.05), visual="<!-- none -->"), "nothing to see"),
        (sdf(box(0.05, 0.05, 0.05), inertial="<inertial><mass>0</mass></inertial>"), "mass 0"),
        ("<sdf version='1.9'><model", "cannot be read"),
    ],
)
def test_a_model_that_cannot_be_used_is_named(tmp_path, text, message):
    if text is not None:
        (tmp_path / "thing.sdf").write_text(text)
    with pytest.raises(SceneError, match=message) as error:
        find_models(str(tmp_path))
    assert "\n" not in str(error.value)
    assert str(tmp_path) in str(error.value)


@pytest.mark.renders
def test_a_model_that_falls_over_is_named(tmp_path):
    tower = sdf("<cylinder><radius>0.02</radius><length>0.06</length></cylinder>", pose="0 0 0 0.9 0 0")
    (tmp_path / "tower.sdf").write_text(tower)
    with pytest.raises(SceneError, match="tower does not stay where it is put"):
        draw(0, objects=str(tmp_path), count_min=1, count_max=1)


HOUSEHOLD = ["package://riseg_drake_models/household"]
CARTONS = [f"carton_{name}" for name in ("tea", "oats", "soap", "rice", "biscuits", "muesli", "filters")]


def test_objects_come_from_several_folders(tmp_path):
    write_plain_models(tmp_path)
    models = find_models([str(tmp_path), *HOUSEHOLD], ["brick", "box_white"])
    assert [model.name for model in models] == ["box_white", "brick"]


def test_placed_objects_stand_exactly_where_the_scenario_says(tmp_path):
    write_plain_models(tmp_path)
    placed = [
        PlacedConfig(str(tmp_path / "brick.sdf"), [0.5, 0.1, 0.02, 0.0, 0.0, 0.5]),
        PlacedConfig(str(tmp_path / "can"), [0.4, -0.1, 0.035, 0.1, 0.2, 0.3]),
    ]
    scene = make_scene(SceneConfig(placed=placed), np.random.default_rng(0))
    assert [item.name for item in scene] == ["brick", "can"]
    np.testing.assert_array_equal(scene[1].X_WB.translation(), [0.4, -0.1, 0.035])
    # Roll, pitch, yaw are turns about W's x, y, z, one after the other.
    R = (
        RotationMatrix.MakeZRotation(0.3)
        @ RotationMatrix.MakeYRotation(0.2)
        @ RotationMatrix.MakeXRotation(0.1)
    )
    np.testing.assert_allclose(scene[1].X_WB.rotation().matrix(), R.matrix(), atol=1e-15)


@pytest.mark.parametrize(
    ("placed", "message"),
    [
        (PlacedConfig("no/such.sdf"), r"^placed\[0\].model: no file no/such.sdf"),
        (PlacedConfig(HOUSEHOLD[0]), "0 models in"),
        (PlacedConfig(f"{HOUSEHOLD[0]}/box_white", [0.5, 0.0]), "2 numbers; expected x, y, z"),
        (PlacedConfig(f"{HOUSEHOLD[0]}/box_white", [0.5, 0, 0, 0, 0, 90.0]), "are radians"),
    ],
)
def test_a_placed_object_that_cannot_be_says_why(placed, message):
    with pytest.raises(SceneError, match=message) as error:
        make_scene(SceneConfig(placed=[placed]), np.random.default_rng(0))
    assert "\n" not in str(error.value)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"placed": []}, "placed: an empty list; expected one object or more"),
        ({"count_min": 2}, "count_min: of no account where objects are `placed`"),
        ({"layout": "pile", "radius": 0.2}, "layout, radius: of no account"),
        ({"objects": HOUSEHOLD, "names": ["can_tuna"]}, "objects, names: of no account"),
        ({"gap_max": 0.05, "touch_probability": 1.0}, "touch_probability, gap_max: of no account"),
    ],
)
def test_a_scene_is_drawn_or_placed_and_not_both_or_neither(options, message):
    config = SceneConfig(**{"placed": [PlacedConfig(f"{HOUSEHOLD[0]}/box_white")], **options})
    with pytest.raises(SceneError, match=message) as error:
        make_scene(config, np.random.default_rng(0))
    assert "\n" not in str(error.value)


@pytest.mark.parametrize("counts", [{"count_min": 1, "count_max": 1}, {"count_max": 1}, {"count_min": 1}])
def test_a_pile_of_one_is_refused_for_what_it_is(counts):
    with pytest.raises(SceneError, match="a pile is 2 things or more"):
        draw(0, layout="pile", **counts)


def test_a_pile_that_never_rests_is_not_said_to_be_too_large(monkeypatch):
    monkeypatch.setattr(scene_module, "lay_pile", lambda *_: None)
    with pytest.raises(SceneError, match=r"2 objects \(.*\) do not come to rest as a pile within 0.2 m"):
        draw(0, layout="pile", count_min=2, count_max=2)


@pytest.mark.parametrize("names", [["bowl_blue", "can_tuna"], ["box_white", "bowl_blue", "can_tuna"]])
def test_packed_wants_two_things_with_flat_sides(names):
    with pytest.raises(SceneError, match=r"^layout: packed lays flat sides together, but .*can_tuna are round"):
        draw(0, layout="packed", objects=HOUSEHOLD, names=names, count_min=2, count_max=2)


def test_boxes_and_cans_that_lie_have_flat_sides_and_what_stands_round_has_none():
    names = ["bowl_blue", "box_white", "can_soda_lying", "can_tuna", "remote"]
    flat = {model.name: model.has_flat_sides for model in find_models(HOUSEHOLD, names)}
    assert [name for name in names if flat[name]] == ["box_white", "can_soda_lying", "remote"]


@pytest.mark.parametrize(
    ("find", "wrong", "near"),
    [
        (find_models, "package://riseg_drake_models/houshold", "models/household"),
        (find_models, "package://riseg_drake_models/houshold/box_white", "models/household"),
        (find_model, f"{HOUSEHOLD[0]}/box_wite", "household/box_white"),
        (find_models, "{folder}/thngs", "{folder}/things"),
        (find_model, "{folder}/things/brik.sdf", "{folder}/things/brick.sdf"),
    ],
)
def test_a_misspelt_folder_or_model_is_answered_with_the_nearest_name(tmp_path, find, wrong, near):
    (tmp_path / "things").mkdir()
    write_plain_models(tmp_path / "things")
    with pytest.raises(SceneError) as error:
        find(wrong.format(folder=tmp_path))
    said = str(error.value)
    assert "\n" not in said
    assert said.endswith(f"{near.format(folder=tmp_path)}?")
    assert "; did you mean " in said


def test_another_package_than_the_models_of_this_one_is_named():
    with pytest.raises(SceneError, match=r"riseg_drke_models/household: no such package; expected package://"):
        find_models("package://riseg_drke_models/household")


@pytest.mark.renders
def test_packed_cartons_hang_together_by_gaps_of_a_millimetre_and_stay():
    config = load_scenario(KINDS["packed"]).simulated.scene
    figures = [packed(config, seed) for seed in range(20)]
    assert [str(each) for each in figures if not each.holds] == []


@pytest.mark.renders
def test_packed_cartons_have_parallel_sides():
    scene = draw(0, layout="packed", objects=HOUSEHOLD, names=CARTONS)
    first = lying(scene[0]).pieces[0]
    along = np.arctan2(*(first[1] - first[0])[::-1])
    edges = [np.roll(piece, -1, 0) - piece for item in scene for piece in lying(item).pieces]
    sides = np.arctan2(*np.vstack(edges).T[::-1])
    assert np.allclose(np.sin(2 * (sides - along)), 0.0, atol=1e-3)


def test_faces_laid_together_are_not_driven_apart(tmp_path):
    for name, (x, y, z) in {"low": (0.09, 0.05, 0.03), "high": (0.06, 0.05, 0.08)}.items():
        (tmp_path / f"{name}.sdf").write_text(sdf(box(x, y, z)))
    low, high = find_model(str(tmp_path / "low.sdf")), find_model(str(tmp_path / "high.sdf"))
    placed = [
        PlacedObject(low, RigidTransform([0.5, 0.0, 0.015])),
        PlacedObject(high, RigidTransform([0.5, 0.05, 0.04])),  # flush: no gap at all
        PlacedObject(low, RigidTransform([0.5, 0.10, 0.015])),
    ]
    for before, after in zip(placed, settle(placed, (0.5, 0.0)), strict=True):
        assert np.linalg.norm(after.X_WB.translation() - before.X_WB.translation()) < 1e-4
        np.testing.assert_allclose(after.X_WB.rotation().matrix(), before.X_WB.rotation().matrix(), atol=2e-3)


def test_thin_things_that_fall_onto_an_edge_do_not_jump_higher_than_they_fell(tmp_path):
    inertial = (
        "<inertial><mass>0.04</mass>"
        "<inertia><ixx>3.3e-6</ixx><iyy>8.4e-5</iyy><izz>8.7e-5</izz></inertia></inertial>"
    )
    (tmp_path / "ruler.sdf").write_text(sdf(box(0.16, 0.03, 0.005), inertial=inertial))
    ruler = find_model(str(tmp_path / "ruler.sdf"))
    rng = np.random.default_rng(0)
    falling = [
        PlacedObject(ruler, RigidTransform(RollPitchYaw(rng.uniform(-np.pi, np.pi, 3)), [0.4 * k, 0.0, 0.2]))
        for k in range(20)
    ]
    table = SettlingTable(falling, (4.0, 0.0))
    for _ in range(5):
        table.settle(0.4)
        assert max(item.X_WB.translation()[2] for item in table.objects()) < 0.2


def test_a_tower_of_boxes_is_at_rest_and_known_as_a_pile(tmp_path):
    (tmp_path / "slab.sdf").write_text(sdf(box(0.08, 0.06, 0.02)))
    slab = find_model(str(tmp_path / "slab.sdf"))
    tower = [PlacedObject(slab, RigidTransform([0.5 + 0.01 * k, 0.0, 0.01 + 0.02 * k])) for k in range(3)]
    table = SettlingTable(tower, (0.5, 0.0))
    assert table.settle(2.0)
    assert table.touching() == {frozenset(pair) for pair in ((0, 1), (1, 2), (2, 3))}
    for before, after in zip(tower, table.objects(), strict=True):
        shift = after.X_WB.translation() - before.X_WB.translation()
        assert np.linalg.norm(shift[:2]) < 2e-4
        assert -3e-4 < shift[2] < 0  # pressed in by its own weight, three deep


def test_a_tower_stays_and_a_slab_that_leans_past_its_balance_does_not(tmp_path):
    (tmp_path / "slab.sdf").write_text(sdf(box(0.08, 0.06, 0.02)))
    slab = find_model(str(tmp_path / "slab.sdf"))
    tower = [PlacedObject(slab, RigidTransform([0.5, 0.0, 0.01 + 0.02 * k])) for k in range(3)]
    leaning = PlacedObject(slab, RigidTransform(RollPitchYaw(0.0, 1.2, 0.0), [0.7, 0.0, 0.042]))
    assert SettlingTable(tower, (0.5, 0.0)).stay(1.0)
    assert not SettlingTable([*tower, leaning], (0.5, 0.0)).stay(1.0)


def test_a_pile_has_half_of_its_objects_against_others_and_one_carried():
    table = [frozenset((0, k)) for k in (1, 2, 3, 4)]
    assert is_pile({frozenset((0, 1)), frozenset((1, 2))}, 2)
    assert not is_pile({*table[:2], frozenset((1, 2))}, 2), "side by side"
    assert not is_pile({*table, frozenset((4, 5))}, 5), "two of five"
    assert not is_pile(set(table), 4)


@pytest.mark.renders
def test_a_drawn_pile_is_at_rest_inside_the_work_area_and_the_same_again():
    options = {"objects": HOUSEHOLD, "names": [*CARTONS, "box_white", "can_tuna"], "layout": "pile"}
    scene, again = (draw(2, **options, count_max=5) for _ in range(2))
    assert [item.name for item in scene] == [item.name for item in again]
    for item, other in zip(scene, again, strict=True):
        np.testing.assert_array_equal(item.X_WB.GetAsMatrix4(), other.X_WB.GetAsMatrix4())
        corners = item.X_WB.multiply(item.model.corners.T).T
        assert np.linalg.norm(corners[:, :2] - (0.5, 0.0), axis=1).max() < 0.2
    table = SettlingTable(scene, (0.5, 0.0))
    table.settle(0.4)
    assert is_pile(table.touching(), len(scene))
    for before, after in zip(scene, table.objects(), strict=True):
        assert np.linalg.norm(after.X_WB.translation() - before.X_WB.translation()) < 5e-4


def test_where_as_many_as_were_drawn_have_no_room_there_are_fewer():
    config = SceneConfig(objects="package://riseg_drake_models/household", layout="spread")
    assert len(draw_scene(config, np.random.default_rng(911))) == 5  # six were drawn, three times in vain


def test_where_there_is_room_for_the_fewest_alone_these_are_drawn(monkeypatch):
    drawn = []

    def two_at_most(shapes, gaps, habit, rng):
        drawn.append(len(shapes))
        return lay_out(shapes, gaps, habit, rng) if len(shapes) <= 2 else None

    monkeypatch.setattr(scene_module, "lay_out", two_at_most)
    config = SceneConfig(layout="crowd", count_min=2, count_max=9)
    seed = next(s for s in range(99) if np.random.default_rng(s).integers(2, 10) == 9)
    assert len(draw_scene(config, np.random.default_rng(seed))) == 2
    # Each choice of objects is tried five times, two with nine, and then one fewer each time.
    assert drawn[::5] == [9, 9, 8, 7, 6, 5, 4, 3, 2]


def test_objects_are_drawn_thirty_times_before_there_is_no_room_for_so_many(monkeypatch):
    drawn = []

    def the_last(shapes, gaps, habit, rng):
        drawn.append(len(shapes))
        return lay_out(shapes, gaps, habit, rng) if len(drawn) >= room else None

    monkeypatch.setattr(scene_module, "lay_out", the_last)
    config = SceneConfig(layout="spread", count_min=3, count_max=3)
    room = 5 * 29 + 1
    assert len(draw_scene(config, np.random.default_rng(1))) == 3
    drawn.clear()
    room = 5 * 30 + 1
    with pytest.raises(SceneError, match=r"3 objects .* do not fit within"):
        draw_scene(config, np.random.default_rng(1))
    assert len(drawn) == 5 * 30
