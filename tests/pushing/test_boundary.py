import numpy as np

from riseg_drake.pushing.boundary import BoundaryParameters, boundary


def test_points_lie_on_the_outline_all_around(drawn):
    table = drawn.disc(0.5, 0.0, 0.03).map()
    center_W = np.array([0.5, 0.0])
    B = boundary(table.objects, center_W, table, BoundaryParameters(directions=24))
    assert len(B) == 24
    np.testing.assert_allclose(np.linalg.norm(B - center_W, axis=1), 0.03, atol=table.cell)


def test_no_point_lies_where_another_cluster_touches(drawn):
    drawn.box(0.48, 0.0, 0.04, 0.04)
    cluster = drawn.objects.copy()
    table = drawn.box(0.5195, 0.0, 0.04, 0.04).map()
    B = boundary(cluster, np.array([0.48, 0.0]), table)
    assert len(B)
    assert (B[np.abs(B[:, 1]) < 0.016, 0] < 0.48).all()
    assert (B[:, 0] < 0.499).all()


def test_points_with_more_room_behind_them_come_first(drawn):
    drawn.disc(0.5, 0.0, 0.03)
    cluster = drawn.objects.copy()
    table = drawn.box(0.56, 0.0, 0.02, 0.06).map()  # a wall ahead in x
    B = boundary(cluster, np.array([0.5, 0.0]), table)
    assert B[0, 0] < 0.5
    assert B[-1, 0] > 0.52


def test_cluster_that_is_walled_in_has_no_boundary_point(drawn):
    drawn.disc(0.5, 0.0, 0.03)
    cluster = drawn.objects.copy()
    table = drawn.disc(0.5, 0.0, 0.06).map()
    assert len(boundary(cluster, np.array([0.5, 0.0]), table)) == 0
