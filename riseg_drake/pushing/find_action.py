"""Alg. 3 of the paper: FindAction, the push that is to be done next, or null (None)."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from riseg_drake.pushing.boundary import BoundaryParameters, boundary
from riseg_drake.pushing.clusters import Cluster, ClustersParameters, find_clusters
from riseg_drake.pushing.contact import find_contacts
from riseg_drake.pushing.objects_to_segment import ObjectsToSegmentParameters, objects_to_segment
from riseg_drake.pushing.push import Push
from riseg_drake.pushing.push_path import PushPath
from riseg_drake.pushing.pusher import Pusher
from riseg_drake.pushing.ranking import RankingParameters, cost_of_pushes
from riseg_drake.pushing.table_map import TableMap, TableMapParameters
from riseg_drake.pushing.tried_pushes import TriedPush
from riseg_drake.pushing.validity import ValidityParameters, is_valid_push


@dataclass
class FindActionParameters:
    """Everything Alg. 3 can be told."""

    table: TableMapParameters = field(default_factory=TableMapParameters)
    to_segment: ObjectsToSegmentParameters = field(default_factory=ObjectsToSegmentParameters)
    clusters: ClustersParameters = field(default_factory=ClustersParameters)
    boundary: BoundaryParameters = field(default_factory=BoundaryParameters)
    validity: ValidityParameters = field(default_factory=ValidityParameters)
    pusher: Pusher = field(default_factory=Pusher)
    ranking: RankingParameters = field(default_factory=RankingParameters)
    paths: int = 30
    """The arm's path is planned for at most this many candidates, the best, before finer clusters."""


def find_action(
    table: TableMap,
    rng: np.random.Generator,
    parameters: FindActionParameters | None = None,
    *,
    tried: Sequence[TriedPush] = (),
    heading_W: NDArray | None = None,
    plan_path: Callable[[Push], PushPath | None] | None = None,
) -> Push | None:
    """FindAction: the best valid push that the arm can do, or None when there is nothing to segment or
    no such push.

    Args:
        table: line 1, objMask on the map, with binL (line 2) beside it.
        rng: for the clustering.
        parameters: the defaults if None.
        tried: pushes made so far.
        heading_W: [2], where the tool's +x points now; turning away from it costs time.
        plan_path: the arm's path for a push, None where it cannot do it. Without it every push counts
            as reachable and comes without a path.
    """
    parameters = parameters or FindActionParameters()
    to_segment = objects_to_segment(table, parameters.to_segment)  # line 3
    if not to_segment.any():  # line 4
        return None  # line 5
    rounds = find_clusters(to_segment, table, parameters.clusters, rng)  # line 6
    divisions = []
    for clusters in rounds:
        divisions.append(clusters)
        push = best_push(clusters, table, tried, heading_W, plan_path, parameters)
        if push is not None:
            return push  # lines 11, 12
    if parameters.validity.l_act_last > parameters.validity.l_act:
        validity = replace(parameters.validity, l_act=parameters.validity.l_act_last)
        parameters = replace(parameters, validity=validity)
        for clusters in divisions:
            push = best_push(clusters, table, tried, heading_W, plan_path, parameters)
            if push is not None:
                return push
    return None  # line 17


def best_push(
    clusters: Sequence[Cluster],
    table: TableMap,
    tried: Sequence[TriedPush],
    heading_W: NDArray | None,
    plan_path: Callable[[Push], PushPath | None] | None,
    parameters: FindActionParameters,
) -> Push | None:
    """The best of the valid pushes of all clusters that the arm can do (lines 7 to 12); None if none.

    `heading_W` is the direction [2] in which the pusher points now; None: all are alike.
    """
    largest = max(int(cluster.cells.sum()) for cluster in clusters)
    pushes: list[Push] = []
    for cluster in clusters:  # line 8
        B = boundary(cluster.cells, cluster.center_W, table, parameters.boundary)  # line 7
        pushes += valid_pushes(  # lines 9, 10
            B, cluster, table, largest, tried, heading_W, parameters
        )
    pushes.sort(key=lambda push: push.cost)
    if plan_path is None:
        return pushes[0] if pushes else None
    for push in pushes[: parameters.paths]:
        path = plan_path(push)
        if path is not None:
            return replace(push, path=path)
    return None


def valid_pushes(
    boundary_W: NDArray,
    cluster: Cluster,
    table: TableMap,
    largest_cluster: int,
    tried: Sequence[TriedPush],
    heading_W: NDArray | None,
    parameters: FindActionParameters,
) -> list[Push]:
    """The pushes from boundary points [N, 2] towards the center of their cluster that are valid.

    Beyond the paper's IsValidPush: the bar touches the cluster before anything else, low enough but not
    too close to the table, and nothing is driven out of the work area.
    """
    if not len(boundary_W):
        return []
    validity, pusher = parameters.validity, parameters.pusher
    center_W, P = cluster.center_W, cluster.cells
    direction_W = center_W - boundary_W
    direction_W /= np.linalg.norm(direction_W, axis=1, keepdims=True)
    contacts = find_contacts(boundary_W, direction_W, P, table, pusher, validity)
    is_valid = is_valid_push(contacts.b_W, direction_W, center_W, P, table, pusher, validity)
    cost = cost_of_pushes(
        contacts, direction_W, is_valid.overlap, P, table, largest_cluster, tried, heading_W,
        validity, parameters.ranking,
    )  # fmt: skip
    possible = (
        is_valid.valid
        & contacts.high_enough
        & contacts.only_target
        & stays_in_work_area(direction_W, P, table, validity.d_push)
        & np.isfinite(cost)
    )
    tallest = float(table.height.max())
    cluster_W = table.points(P)
    length = validity.clearance + validity.d_push
    pushes = []
    for n in np.flatnonzero(possible):
        b_W, ahead_W, tip = contacts.b_W[n], direction_W[n], float(contacts.tip_height[n])
        start_W = b_W - (validity.clearance + pusher.thickness / 2) * ahead_W
        ground = float(table.ground(b_W + np.outer([-1, 1], length * ahead_W)).max())
        pushes.append(
            Push(
                p_WE=np.append(start_W, ground + tip),
                tip_height=tip,
                direction_W=ahead_W,
                p_WB=np.append(b_W, ground + max(tip, contacts.height[n] / 2)),
                length=length,
                d_push=validity.d_push,
                center_W=center_W,
                cluster_W=cluster_W,
                tallest=tallest,
                cost=float(cost[n]),
            )
        )
    return pushes


def stays_in_work_area(
    direction_W: NDArray, cluster: NDArray[np.bool_], table: TableMap, distance: float
) -> NDArray[np.bool_]:
    """Which directions [N, 2] do not move more of a cluster out of the work area than lies there now."""
    P = table.points(cluster)
    before = np.count_nonzero(~table.in_work_area(P))
    after = np.count_nonzero(~table.in_work_area(P[None] + distance * direction_W[:, None]), axis=1)
    return after <= before
