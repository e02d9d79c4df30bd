"""Which of many valid pushes is to be made: the one from which most is expected.

The paper takes the first valid push. Here each is worth the number of objects that it can be expected to
settle: the chance that its target is an object, times the chances of what must go well for it to be seen moving
by itself. Chances multiply, so no weights are needed to trade one against another.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from riseg_drake.pushing.contact import Contacts
from riseg_drake.pushing.tried_pushes import KnownScene, novelty
from riseg_drake.pushing.validity import ValidityParameters, overlap_after_push


@dataclass
class GainParameters:
    """What the chances depend on (none of it in the paper)."""

    object_area: float = 1e-3
    """Half of the things that are this large, m^2, are objects; what is much smaller is a part of one."""
    slips: float = 0.2
    """Chance that a tip which touches with nothing but a corner slips off."""
    unseen: float = 0.3
    """Chance that something stands on a way that the camera could not see."""
    turning: float = 0.3
    """What turning the camera by half a turn takes off: it costs time, and takes the scene out of view."""
    tries: int = 2
    """What is still one after so many pushes is not pushed again."""
    least: float = 0.03
    """What is in doubt is not pushed for less than this: the push stirs what is well known, too."""
    same: float = 0.1
    """A push that is less new than this, after one that changed nothing, is not made: within 1.5 cm and 0.6 rad
    it is the same."""
    tried_distance: float = 0.035
    """Distance, m, over which a push is like one that was made."""


def most_to_expect(area: float, tries: int, parameters: GainParameters) -> float:
    """Objects that any push of a thing can settle at most: of `area`, m^2, and pushed so often before."""
    if tries >= parameters.tries:
        return 0.0
    return float(area / (area + parameters.object_area) * 0.5**tries)


def expected_gain(
    contacts: Contacts,
    direction_W: NDArray,
    overlap: NDArray,
    cluster: NDArray[np.bool_],
    tries: int,
    known: KnownScene,
    validity: ValidityParameters,
    parameters: GainParameters,
) -> NDArray[np.float64]:
    """Objects [N] that N candidates of one cluster can be expected to settle; 0 for those to be refused.

    `overlap` [N] is |isect| / |P|, and `tries` how often the cluster was pushed before.
    """
    table, tried = known.table, known.tried
    P = table.points(cluster)
    along = P @ direction_W.T  # [M, N]
    extent = along.max(axis=0) - along.min(axis=0) + table.cell
    top = float(np.percentile(table.height[cluster], 95))
    # Free space ahead is better than a gap just wide enough.
    crowded = (overlap + overlap_after_push(direction_W, cluster, table, 2 * validity.d_push)) / 2
    new = novelty(contacts.b_W, direction_W, tried, parameters.tried_distance)  # [N, T]
    gain = (
        most_to_expect(len(P) * table.cell_area, tries, parameters)
        * np.exp(-crowded / validity.l_act)  # moves alone
        * (1.0 - contacts.beside_target)  # and nothing else with it
        * contacts.transmitted
        * (1.0 - parameters.slips * (1.0 - contacts.face))
        * (1.0 - parameters.unseen * contacts.unseen)
        / np.maximum(top / extent, 1.0)  # tall narrow things topple
        * new.min(axis=1, initial=1.0)
    )  # fmt: skip
    if known.heading_W is not None:
        turn = np.arccos(np.clip(direction_W @ known.heading_W, -1.0, 1.0))
        gain *= 1.0 - parameters.turning * turn / np.pi
    in_vain = new[:, [not push.changed for push in tried]].min(axis=1, initial=1.0)
    gain[in_vain < parameters.same] = 0.0
    return gain
