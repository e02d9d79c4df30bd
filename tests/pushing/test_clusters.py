import numpy as np
import pytest

from riseg_drake.pushing.clusters import (
    ClustersParameters,
    concavity,
    find_clusters,
    split_at_necks,
    take_apart,
)


def first_clusters(table, **parameters):
    rng = np.random.default_rng(0)
    return next(find_clusters(table.objects, table, ClustersParameters(**parameters), rng))


def test_separate_things_are_a_cluster_each_however_different_in_size(drawn):
    drawn.box(0.4, 0.0, 0.08, 0.06, yaw=0.3).disc(0.5, 0.06, 0.015).disc(0.5, 0.0, 0.03)
    table = drawn.box(0.62, -0.1, 0.02, 0.03).map()
    clusters = first_clusters(table)
    assert len(clusters) == 4
    assert (sum(cluster.cells.astype(int) for cluster in clusters) == table.objects).all()


def test_things_that_touch_in_a_corner_are_cut_there(drawn):
    drawn.box(0.48, -0.02, 0.04, 0.04).box(0.5195, 0.0195, 0.04, 0.04)
    table = drawn.map()
    assert len(split_at_necks(table.objects, table, neck=0.006, smallest=0.0)) == 2


def test_things_that_touch_along_a_face_are_told_apart_by_the_elbow(drawn):
    table = drawn.box(0.475, 0.01, 0.05, 0.04).box(0.525, -0.01, 0.05, 0.04).map()
    assert len(split_at_necks(table.objects, table, neck=0.006, smallest=0.0)) == 1
    x = sorted(cluster.center_W[0] for cluster in first_clusters(table))
    assert x == pytest.approx([0.475, 0.525], abs=0.004)


def test_convex_thing_stays_whole(drawn):
    table = drawn.box(0.5, 0.0, 0.12, 0.03, yaw=0.4).map()
    assert concavity(table.objects, table.cell) <= 0.002
    assert len(first_clusters(table)) == 1


def test_concavity_is_the_depth_of_the_deepest_nook(drawn):
    drawn.box(0.5, 0.0, 0.06, 0.06)
    drawn.objects[(np.abs(drawn.centres() - [0.5, 0.03]) < [0.008, 0.02]).all(-1)] = False
    assert concavity(drawn.objects, 0.002) == pytest.approx(0.02, abs=0.003)


def test_paper_clusters_everything_at_once(drawn):
    table = drawn.disc(0.4, -0.1, 0.02).disc(0.6, -0.1, 0.02).disc(0.5, 0.1, 0.02).map()
    assert len(first_clusters(table, by_piece=False)) == 3


def test_ring_gets_finer_until_the_centers_lie_on_it(drawn):
    table = drawn.disc(0.5, 0.0, 0.05, hole=0.035).map()
    rounds = list(find_clusters(table.objects, table, ClustersParameters(), np.random.default_rng(0)))
    on_ring = [all(table.lookup(table.objects, c.center_W) for c in clusters) for clusters in rounds]
    assert not on_ring[0]
    assert on_ring[-1]


def test_heap_of_touching_things_is_taken_apart(drawn):
    places = [(0.45, 0.0, 0.03), (0.505, 0.0, 0.027), (0.475, 0.05, 0.03), (0.53, 0.05, 0.028)]
    for x, y, radius in places:
        drawn.disc(x, y, radius)
    centers = np.array([cluster.center_W for cluster in first_clusters(drawn.map())])
    distance = np.linalg.norm(np.array(places)[:, None, :2] - centers, axis=-1)
    assert distance.shape == (4, 4)
    assert (distance.min(axis=1) < 0.008).all()


def test_limbs_stay_with_their_body(drawn):
    drawn.box(0.5, 0.0, 0.07, 0.04)
    for x in (0.472, 0.528):
        drawn.box(x, -0.03, 0.012, 0.03)
    table = drawn.map()
    assert len(take_apart(table.objects, table, ClustersParameters())) == 1


def test_piece_with_a_nook_that_nothing_divides_is_at_least_two_clusters(drawn):
    table = drawn.disc(0.5, 0.0, 0.05).disc(0.55, 0.0, 0.025).box(0.5, -0.05, 0.07, 0.05).map()
    if len(take_apart(table.objects, table, ClustersParameters())) > 1:
        pytest.fail("the drawing has a neck; it should not")
    assert concavity(table.objects, table.cell) > ClustersParameters().concavity
    assert len(first_clusters(table)) >= 2


@pytest.mark.parametrize(("bridge", "pieces"), [(0.004, 2), (0.009, 1)])
def test_what_is_smaller_than_a_part_is_cut_off_only_at_a_neck_of_less_than_6_mm(drawn, bridge, pieces):
    # 2.5 cm^2, held by a bridge to a box of 25 cm^2: a limb, unless there is next to nothing between them.
    drawn.box(0.5, 0.0, 0.05, 0.05).box(0.54, 0.0, 0.016, 0.016).box(0.528, 0.0, 0.01, bridge)
    table = drawn.map()
    assert len(take_apart(table.objects, table, ClustersParameters())) == pieces


def test_parts_of_a_piece_with_a_nook_are_cut_up_to_3_cm_and_larger_than_4_square_centimetres(drawn):
    drawn.box(0.5, 0.0, 0.06, 0.06).box(0.56, 0.0, 0.04, 0.04).box(0.535, 0.0, 0.02, 0.016)
    table = drawn.map()
    parts = take_apart(table.objects, table, ClustersParameters())
    assert len(parts) == 2
    np.testing.assert_array_equal(sum(part.astype(int) for part in parts), table.objects)
    whole = ClustersParameters(widest_neck=0.008)
    assert len(take_apart(table.objects, table, whole)) == 1
    assert len(take_apart(table.objects, table, ClustersParameters(smallest_part=2e-3))) == 1
    assert len(take_apart(table.objects, table, ClustersParameters(concavity=0.03))) == 1
