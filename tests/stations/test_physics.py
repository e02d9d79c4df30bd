import numpy as np
import pytest
from pydrake.geometry import Box, Sphere
from pydrake.math import RigidTransform
from pydrake.multibody.plant import AddMultibodyPlantSceneGraph, CoulombFriction
from pydrake.multibody.tree import SpatialInertia
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder, EventStatus, LeafSystem

from riseg_drake.stations.contact import set_contact_model
from riseg_drake.stations.physics import PhysicsError, advance, physics_error

FRICTION = CoulombFriction(0.5, 0.5)
MESSAGE = """MultibodyPlant's discrete update solver failed to converge at simulation time = 12.5 with
discrete update period = 0.004. This usually means that the plant's discrete update period is too large.
Possible solutions include:
  1. reduce the discrete update period set at construction"""


def ball_on_table(velocity: float) -> Simulator:
    builder = DiagramBuilder()
    plant, _ = AddMultibodyPlantSceneGraph(builder, 0.004)
    set_contact_model(plant, over_areas=True)
    down = RigidTransform([0.0, 0.0, -0.5])
    plant.RegisterCollisionGeometry(plant.world_body(), down, Box(4, 4, 1), "table", FRICTION)
    ball = plant.AddRigidBody("ball", SpatialInertia.SolidSphereWithMass(0.1, 0.05))
    plant.RegisterCollisionGeometry(ball, RigidTransform(), Sphere(0.05), "ball", FRICTION)
    plant.Finalize()
    simulator = Simulator(builder.Build())
    context = plant.GetMyContextFromRoot(simulator.get_mutable_context())
    plant.SetFloatingBaseBodyPoseInWorldFrame(context, ball, RigidTransform([0.0, 0.0, 0.049]))
    context.get_mutable_discrete_state(0).get_mutable_value()[-1] = velocity
    return simulator


def test_the_simulation_goes_on_up_to_the_time_or_to_where_a_monitor_stops_it():
    simulator = ball_on_table(0.0)
    advance(simulator, 0.1)
    assert simulator.get_context().get_time() == pytest.approx(0.1)
    simulator.set_monitor(
        lambda root: (
            EventStatus.ReachedTermination(simulator.get_system(), "")
            if root.get_time() > 0.15
            else EventStatus.DidNothing()
        )
    )
    advance(simulator, 1.0)
    assert simulator.get_context().get_time() < 0.17


def test_where_the_contact_solver_fails_one_line_says_when_why_and_what_helps():
    simulator = ball_on_table(np.nan)
    with pytest.raises(PhysicsError, match=r"after 0\.000 s: .*NaN; another seed or"):
        advance(simulator, 0.1)


class Shouting(LeafSystem):
    def __init__(self, error: BaseException):
        super().__init__()
        self.error = error
        self.DeclarePeriodicUnrestrictedUpdateEvent(0.1, 0.0, self.shout)

    def shout(self, context, state):
        raise self.error


@pytest.mark.parametrize("error", [RuntimeError("mine"), SystemExit(3), KeyboardInterrupt()])
def test_what_a_system_in_python_raises_is_no_failure_of_the_physics(error):
    builder = DiagramBuilder()
    builder.AddSystem(Shouting(error))
    with pytest.raises(type(error)) as raised:
        advance(Simulator(builder.Build()), 1.0)
    assert not isinstance(raised.value, PhysicsError)


def test_of_a_long_message_the_first_sentence_is_said():
    assert str(physics_error(MESSAGE, 12.5)) == (
        "the simulation failed after 12.500 s: MultibodyPlant's discrete update solver failed to converge at "
        "simulation time = 12.5 with discrete update period = 0.004; another seed or a shorter "
        "station.time_step may help"
    )
