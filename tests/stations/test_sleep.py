"""A bar on a rail and a box on a table, simulated with and without sleep."""

import numpy as np
import pytest
from pydrake.geometry import Box
from pydrake.math import RigidTransform
from pydrake.multibody.plant import AddMultibodyPlantSceneGraph, CoulombFriction
from pydrake.multibody.tree import FixedOffsetFrame, PrismaticJoint, SpatialInertia
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder

from riseg_drake.stations.contact import let_touch, set_contact_model
from riseg_drake.stations.sleep import ROOM, SUDDEN, Sleep

FRICTION = CoulombFriction(0.5, 0.5)
PERIOD, STEP = 0.06, 0.004
FACE = -0.03
"""x of a box's face towards the bar, in its own frame, m; in W the first one's is 0."""


class Rail:
    """A very heavy bar that slides along x, with its face at `x`, m, and two boxes in a row before it."""

    def __init__(self, x: float, speed: float, *, sleeps: bool = True):
        builder = DiagramBuilder()
        plant, scene_graph = AddMultibodyPlantSceneGraph(builder, STEP)
        set_contact_model(plant, over_areas=True)

        def shape(body, size, z=0.0):
            where = RigidTransform([0, 0, z])
            return plant.RegisterCollisionGeometry(body, where, Box(*size), "shape", FRICTION)

        tool = plant.AddModelInstance("tool")
        bar = plant.AddRigidBody("bar", tool, SpatialInertia.SolidBoxWithMass(5e3, 0.02, 0.03, 0.1))
        rail = plant.AddFrame(FixedOffsetFrame("rail", plant.world_frame(), RigidTransform([0, 0, 0.06])))
        joint = plant.AddJoint(PrismaticJoint("rail", rail, bar.body_frame(), [1, 0, 0]))
        plant.set_gravity_enabled(tool, False)
        self.boxes = []
        for k in range(2):
            inertia = SpatialInertia.SolidBoxWithMass(0.2, 0.06, 0.06, 0.1)
            self.boxes.append(plant.AddRigidBody("box", plant.AddModelInstance(f"box{k}"), inertia))
        let_touch(plant, scene_graph, [shape(box, (0.06, 0.06, 0.1)) for box in self.boxes])
        hard = [shape(plant.world_body(), (2, 2, 0.5), -0.25), shape(bar, (0.02, 0.03, 0.1))]
        let_touch(plant, scene_graph, hard, rigid=True)
        plant.Finalize()
        self.plant, self.bar = plant, bar
        self.simulator = Simulator(builder.Build())
        self.root = self.simulator.get_mutable_context()
        self.context = plant.GetMyMutableContextFromRoot(self.root)
        for k, box in enumerate(self.boxes):
            X_WB = RigidTransform([0.1 * k - FACE, 0.0, 0.05])
            plant.SetFloatingBaseBodyPoseInWorldFrame(self.context, box, X_WB)
        joint.set_translation(self.context, x - 0.01)
        joint.set_translation_rate(self.context, speed)
        bodies = [box.index() for box in self.boxes]
        self.sleep = Sleep(plant, scene_graph, (tool,), bodies, PERIOD) if sleeps else None

    def look(self, number: int) -> None:
        """Go on until the next look, for a number of looks."""
        for _ in range(number):
            self.simulator.AdvanceTo(self.root.get_time() + PERIOD)
            if self.sleep:
                self.sleep.look(self.root)

    @property
    def gap(self) -> float:
        """From the bar's face to the first box, while that stands where it stood."""
        return -(self.bar.EvalPoseInWorld(self.context).translation()[0] + 0.01)

    @property
    def poses(self) -> np.ndarray:
        return np.array([box.EvalPoseInWorld(self.context).GetAsMatrix4() for box in self.boxes])

    @property
    def contacts(self) -> int:
        results = self.plant.get_contact_results_output_port().Eval(self.context)
        return results.num_hydroelastic_contacts() + results.num_point_pair_contacts()


def test_what_lies_still_sleeps_and_stays_to_the_bit():
    rail = Rail(-0.3, 0.0)
    rail.look(4)
    assert rail.sleep.asleep
    before = rail.poses
    rail.look(3)
    assert np.array_equal(rail.poses, before)
    assert rail.contacts == 0


@pytest.mark.parametrize("speed", [0.02, 0.1, 0.4])
def test_bodies_wake_where_the_robot_could_touch_them_before_the_next_look(speed):
    near = ROOM + PERIOD * (speed + SUDDEN)
    rail = Rail(-near - 8.5 * PERIOD * speed, speed)
    rail.look(8)
    assert rail.sleep.asleep
    assert near < rail.gap
    rail.look(1)
    assert not rail.sleep.asleep
    assert ROOM < rail.gap < near
    rail.simulator.AdvanceTo(rail.root.get_time() + STEP)
    assert rail.contacts == 2  # each box with the table again


def test_a_robot_that_goes_away_lets_them_sleep_from_where_it_could_not_come_back_in_time():
    rail = Rail(-ROOM - PERIOD * SUDDEN + 5.5 * PERIOD * 0.01, -0.01)
    rail.look(5)
    assert not rail.sleep.asleep
    rail.look(1)
    assert rail.sleep.asleep


def test_what_is_pushed_ends_where_it_does_without_sleep():
    awake, asleep = Rail(-0.02, 0.02, sleeps=False), Rail(-0.02, 0.02)
    slept = 0
    for _ in range(30):
        awake.look(1)
        asleep.look(1)
        slept += asleep.sleep.asleep
    assert slept >= 10
    assert awake.poses[0, 0, 3] - 0.03 > 0.015
    p_WB, p_WB_awake = asleep.poses[:, :3, 3], awake.poses[:, :3, 3]
    np.testing.assert_allclose(p_WB, p_WB_awake, atol=5e-5)


def test_what_moves_does_not_sleep_however_far_the_robot_is():
    rail = Rail(-0.5, 0.0)
    body = rail.boxes[0]
    rail.plant.SetFloatingBaseBodyPoseInWorldFrame(rail.context, body, RigidTransform([0.03, 0.0, 0.3]))
    rail.look(1)
    assert not rail.sleep.asleep
    rail.look(20)
    assert rail.sleep.asleep
    np.testing.assert_allclose(rail.poses[0, :3, 3], [0.03, 0.0, 0.05], atol=1e-3)
