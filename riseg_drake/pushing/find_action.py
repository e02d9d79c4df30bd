"""Alg. 3 of the paper: FindAction, the push that is to be done next, or null and the reason."""

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from itertools import chain

import cv2
import numpy as np
from numpy.typing import NDArray

from riseg_drake.pushing.arm_path import PushPath
from riseg_drake.pushing.boundary import BoundaryParameters, boundary
from riseg_drake.pushing.clusters import Cluster, ClustersParameters, find_clusters
from riseg_drake.pushing.contact import find_contacts
from riseg_drake.pushing.decision import Criterion, Decision, Ending, PathStage
from riseg_drake.pushing.gain import GainParameters, expected_gain, most_to_expect
from riseg_drake.pushing.levels import LevelsParameters, raised
from riseg_drake.pushing.objects_to_segment import ObjectsToSegmentParameters, things_to_push
from riseg_drake.pushing.push import NO_PUSH, Push
from riseg_drake.pushing.pusher import Pusher, PusherParameters
from riseg_drake.pushing.room_below import room_below_the_tool
from riseg_drake.pushing.table_map import TableMap, TableMapParameters
from riseg_drake.pushing.tried_pushes import KnownScene, times_pushed
from riseg_drake.pushing.validity import ValidityParameters, is_valid_push, share_after_push
from riseg_drake.robot.tool_shape import ToolShape

ALIKE_DISTANCE = 0.010
"""Where the arm has no path for a push, it is not asked about another that begins this close to it, m ..."""
ALIKE_ANGLE = 0.2
"""... and goes within this angle of its direction, rad."""

PlanPath = Callable[[Push], PushPath | PathStage]
"""The arm's path for a push, or the stage of it that it cannot do."""


@dataclass
class FindActionParameters:
    """Everything Alg. 3 can be told."""

    table: TableMapParameters = field(default_factory=TableMapParameters)
    to_segment: ObjectsToSegmentParameters = field(default_factory=ObjectsToSegmentParameters)
    clusters: ClustersParameters = field(default_factory=ClustersParameters)
    boundary: BoundaryParameters = field(default_factory=BoundaryParameters)
    validity: ValidityParameters = field(default_factory=ValidityParameters)
    pusher: PusherParameters = field(default_factory=PusherParameters)
    gain: GainParameters = field(default_factory=GainParameters)
    levels: LevelsParameters = field(default_factory=LevelsParameters)
    paths: int = 15
    """The arm's path is planned for at most this many candidates, the best that are not alike, with the tool's
    front, and as many with its back."""


def find_action(
    known: KnownScene,
    rng: np.random.Generator,
    tool: ToolShape,
    parameters: FindActionParameters | None = None,
    plan_path: PlanPath | None = None,
) -> Decision:
    """FindAction: the best valid push that the arm can do, or why there is none.

    Args:
        known: the map, and what was tried.
        rng: for the clustering.
        tool: what is pushed with.
        parameters: the defaults if None.
        plan_path: the arm's path for a push, or the stage that it cannot do. Without it every push counts
            as reachable and comes without a path.
    """
    parameters, table = parameters or FindActionParameters(), known.table
    unmoved, doubtful = things_to_push(table, parameters.to_segment)  # line 3
    doubtful_area = float(np.count_nonzero(doubtful)) * table.cell_area
    area = float(np.count_nonzero(unmoved)) * table.cell_area + doubtful_area
    if not area:  # line 4
        return Decision(ending=Ending.NOTHING_LEFT, unsettled_area=0.0)  # line 5
    search = _PathSearch(plan_path, parameters.paths)
    fails: Counter[Criterion | PathStage] = Counter()
    candidates = 0
    # What has never moved comes before what is in doubt; alone before with others; what lies on something else
    # before both, as it has moved with it.
    all_found = replace(table, segmented=table.segmented | (doubtful > 0), doubtful=None)
    on_top = raised(table, doubtful, parameters.to_segment.minimum_area, parameters.levels)
    stages = chain(
        ((unmoved, all_found, True), (unmoved, all_found, False)),
        ((upper, above, True) for upper, above in on_top),
        ((doubtful > 0, table, True), (doubtful > 0, table, False)),
    )
    for to_segment, scene, alone in stages:
        if not to_segment.any() or not (alone or parameters.validity.with_others):
            continue
        turned: list[Push] = []  # beside the camera's view
        for clusters in find_clusters(to_segment, scene, parameters.clusters, rng, scene.doubtful):  # line 6
            pushes, failed = valid_pushes(clusters, replace(known, table=scene), tool, parameters, alone=alone)
            push = search.best([push for push in pushes if not push.turned])
            if push is not None:
                return Decision(push, unsettled_area=area, doubtful_area=doubtful_area)  # lines 11, 12
            turned += [push for push in pushes if push.turned]
            for criterion, which in failed.items():
                fails[criterion] += int(np.count_nonzero(which))
            candidates += len(failed[Criterion.ACCESSIBLE])
        push = search.best(turned)
        if push is not None:
            return Decision(push, unsettled_area=area, doubtful_area=doubtful_area)
    if search.failed:  # line 17
        return Decision(NO_PUSH, Ending.NO_PATH, area, doubtful_area, search.failed.total(), search.failed)
    return Decision(NO_PUSH, Ending.NOTHING_VALID, area, doubtful_area, candidates, +fails)


class _PathSearch:
    """The arm's path for the best push that has one."""

    def __init__(self, plan_path: PlanPath | None, most: int):
        self._plan_path, self._most = plan_path, most
        self._places: list[NDArray] = []  # p_WE and ahead_W of the pushes that have no path
        self._ahead: list[NDArray] = []
        self._asked = [0, 0]  # with the tool's front, and with its back
        self.failed: Counter[Criterion | PathStage] = Counter()
        """How many pushes failed at each stage."""

    def best(self, pushes: list[Push]) -> Push | None:
        """The first of the pushes, best first, that the arm can do."""
        if self._plan_path is None:
            return pushes[0] if pushes else None
        for push in pushes:
            if self._asked[push.turned] == self._most or self._is_like_one_that_failed(push):
                continue
            self._asked[push.turned] += 1
            path = self._plan_path(push)
            if not isinstance(path, PathStage):
                return replace(push, path=path)
            self.failed[path] += 1
            self._places.append(push.p_WE[:2])
            self._ahead.append(push.ahead_W)
        return None

    def _is_like_one_that_failed(self, push: Push) -> bool:
        if not self._places:
            return False
        near = np.linalg.norm(np.array(self._places) - push.p_WE[:2], axis=1) < ALIKE_DISTANCE
        alike = np.array(self._ahead) @ push.ahead_W > np.cos(ALIKE_ANGLE)
        return bool(np.any(near & alike))


def valid_pushes(
    clusters: Sequence[Cluster],
    known: KnownScene,
    tool: ToolShape,
    parameters: FindActionParameters,
    *,
    alone: bool = True,
) -> tuple[list[Push], dict[Criterion, NDArray[np.bool_]]]:
    """The valid pushes of all clusters, best first (lines 7 to 10), and which candidates [N] fail what.

    Those with the back of the tool come last, for where the arm can do no other. Not `alone`, a cluster is
    pushed with all that it touches.
    """
    table = known.table
    pushes: list[Push] = []
    failed: dict[Criterion, list[NDArray]] = {criterion: [] for criterion in Criterion}
    for cluster in clusters:  # line 8
        pushed = cluster.cells if alone else touching(cluster.cells, table)
        B = boundary(pushed, cluster.center_W, table, parameters.boundary)  # line 7
        if not len(B):
            continue
        valid, fails = valid_pushes_of(  # lines 9, 10
            B, cluster, pushed, known, tool, parameters, alone=alone
        )
        pushes += valid
        for criterion, which in fails.items():
            failed[criterion].append(which)
    pushes.sort(key=lambda push: (push.turned, push.cost))
    none = [np.zeros(0, bool)]
    return pushes, {criterion: np.concatenate(which or none) for criterion, which in failed.items()}


def valid_pushes_of(
    boundary_W: NDArray,
    cluster: Cluster,
    pushed: NDArray[np.bool_],
    known: KnownScene,
    tool: ToolShape,
    parameters: FindActionParameters,
    *,
    alone: bool,
) -> tuple[list[Push], dict[Criterion, NDArray[np.bool_]]]:
    """The valid pushes from boundary points [N, 2], N >= 1, towards the center of their cluster, and which
    candidates [N] fail what.

    Beyond the paper's IsValidPush: the tip touches what is to be `pushed` [rows, columns] before anything
    else, low enough but not too close to the table, and nothing is driven out of the work area. Not `alone`,
    that is more than the cluster, which then need not move alone.
    """
    validity, pusher, table = parameters.validity, Pusher(tool, parameters.pusher), known.table
    center_W, P = cluster.center_W, cluster.cells
    direction_W = center_W - boundary_W
    direction_W /= np.linalg.norm(direction_W, axis=1, keepdims=True)
    in_doubt = table.doubtful is not None or table.carrying is not None
    least = parameters.gain.least if in_doubt else 0.0
    thing = P if table.doubtful is None else table.doubtful == table.doubtful[P][0]
    tries = times_pushed(thing, table, known.tried, validity.d_push)
    if most_to_expect(np.count_nonzero(P) * table.cell_area, tries, parameters.gain) <= least:
        # No other criterion needs to be asked, which takes most of the time of a decision.
        none = np.zeros(len(boundary_W), bool)
        return [], {each: ~none if each is Criterion.NOT_IN_VAIN else none for each in Criterion}
    contacts = find_contacts(
        boundary_W, direction_W, pushed, table, pusher, validity, target=None if alone else P
    )
    is_valid = is_valid_push(contacts.b_W, direction_W, center_W, P, table, pusher, validity)
    gain = expected_gain(contacts, direction_W, is_valid.overlap, P, tries, known, validity, parameters.gain)
    room = [
        room_below_the_tool(contacts.b_W, direction_W, contacts.tip_height, pushed, table, each, validity)
        for each in (pusher, pusher.turned())
    ]
    passed = {
        Criterion.CENTER_ON_OBJECT: is_valid.center_on_object,
        Criterion.ACCESSIBLE: is_valid.accessible,
        Criterion.MOVES_ALONE: is_valid.moves_alone | (not alone),
        Criterion.HIGH_ENOUGH: contacts.high_enough,
        Criterion.ONLY_TARGET: contacts.only_target & (contacts.transmitted > 0),
        Criterion.ROOM_BELOW_THE_TOOL: room[False] | room[True],
        Criterion.STAYS_IN_WORK_AREA: stays_in_work_area(direction_W, P, table, validity.d_push),
        Criterion.STAYS_ON_TOP: overhang(direction_W, P, table, validity.d_push) <= validity.l_act,
        Criterion.NOT_IN_VAIN: gain > least,
    }
    tallest = float(table.height.max())
    cluster_W = table.points(P)
    length = validity.clearance + validity.d_push
    pushes = []
    for n in np.flatnonzero(np.all(list(passed.values()), axis=0)):
        b_W, ahead_W, tip = contacts.b_W[n], direction_W[n], float(contacts.tip_height[n])
        start_W = b_W - (validity.clearance + pusher.tool.thickness / 2) * ahead_W
        ground = float(table.ground(b_W + np.outer([-1, 1], length * ahead_W)).max())
        push = Push(
            p_WE=np.append(start_W, ground + tip),
            tip_height=tip,
            direction_W=ahead_W,
            p_WB=np.append(b_W, ground + max(tip, contacts.height[n] / 2)),
            length=length,
            d_push=validity.d_push,
            center_W=center_W,
            cluster_W=cluster_W,
            tallest=tallest,
            cost=float(1.0 - gain[n]),
        )
        pushes += [replace(push, turned=turned) for turned in (False, True) if room[turned][n]]
    return pushes, {criterion: ~passes for criterion, passes in passed.items()}


def touching(cluster: NDArray[np.bool_], table: TableMap) -> NDArray[np.bool_]:
    """Everything on the table that hangs together with a cluster, as cells [rows, columns]."""
    _, piece = cv2.connectedComponents(table.objects.astype(np.uint8), connectivity=8)
    return np.isin(piece, np.unique(piece[cluster]))


def stays_in_work_area(
    direction_W: NDArray, cluster: NDArray[np.bool_], table: TableMap, distance: float
) -> NDArray[np.bool_]:
    """Which directions [N, 2] do not move more of a cluster out of the work area than lies there now."""
    P = table.points(cluster)
    before = np.count_nonzero(~table.in_work_area(P))
    after = np.count_nonzero(~table.in_work_area(P[None] + distance * direction_W[:, None]), axis=1)
    return after <= before


def overhang(
    direction_W: NDArray, cluster: NDArray[np.bool_], table: TableMap, distance: float
) -> NDArray[np.float64]:
    """Share [N] of a cluster on top of others that directions [N, 2] would move out over the table.

    What it hides now carries it.
    """
    if table.carrying is None:
        return np.zeros(len(direction_W))
    return 1.0 - share_after_push(table.carrying, direction_W, cluster, table, distance)
