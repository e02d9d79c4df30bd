import numpy as np
import pytest
from pydrake.systems.analysis import Simulator

from riseg_drake.app.run.onlooker import Onlooker
from riseg_drake.app.scenario import load_scenario
from riseg_drake.stations.filmed_world import looking_at
from riseg_drake.stations.simulated import SimulatedStation


def test_the_target_is_straight_ahead_and_the_worlds_z_points_up_in_the_image():
    X_WC = looking_at(np.array([1.0, -0.5, 0.6]), np.array([0.4, 0.0, 0.1]))
    p_CT = X_WC.inverse() @ np.array([0.4, 0.0, 0.1])
    np.testing.assert_allclose(p_CT[:2], 0, atol=1e-12)
    assert p_CT[2] > 0
    up_C = X_WC.rotation().inverse() @ np.array([0.0, 0.0, 1.0])
    assert up_C[0] == pytest.approx(0)
    assert up_C[1] < 0


@pytest.mark.renders
def test_the_onlooker_sees_the_arm_move_and_the_wrist_camera_does_not_see_the_onlookers_light(small_scenario):
    station = SimulatedStation(load_scenario(small_scenario).station, seed=1)
    alone = SimulatedStation(load_scenario(small_scenario).station, seed=1)
    onlooker = Onlooker(station, 160, 120)
    simulator, other = Simulator(station), Simulator(alone)
    context = simulator.get_mutable_context()
    q = station.GetOutputPort("panda.position_measured").Eval(context)
    for each, system in ((simulator, station), (other, alone)):
        system.GetInputPort("panda.position").FixValue(each.get_mutable_context(), q)
        each.Initialize()
    wrist, reference = (
        system.GetOutputPort("wrist.color_image").Eval(each.get_context()).data
        for each, system in ((simulator, station), (other, alone))
    )
    np.testing.assert_array_equal(wrist, reference)

    before = onlooker.look(context)
    assert len(np.unique(before)) > 20
    station.plant.SetPositions(
        station.plant.GetMyMutableContextFromRoot(context),
        station.plant.GetModelInstanceByName("panda"),
        q + 0.2,
    )
    moved = np.abs(onlooker.look(context).astype(int) - before).max(axis=-1) > 30
    assert 0.02 < moved.mean() < 0.7
