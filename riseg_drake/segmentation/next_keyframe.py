"""The first keyframe, and each that follows: what is believed of it, by what was believed of the one before."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from riseg_drake.geometry.rgbd import Frame
from riseg_drake.segmentation.above_table import AboveTable
from riseg_drake.segmentation.arrivals import have_come, with_arrivals
from riseg_drake.segmentation.belief import Belief, BeliefParameters
from riseg_drake.segmentation.bodies import Bodies, carry_superpixels
from riseg_drake.segmentation.border_prior import border_prior
from riseg_drake.segmentation.carried_evidence import Origin, carried_evidence, were_in_sight
from riseg_drake.segmentation.coincidence import freedoms_shown
from riseg_drake.segmentation.keyframe import Keyframe, make_keyframe
from riseg_drake.segmentation.noise import MeasurementNoise
from riseg_drake.segmentation.observation import Observation
from riseg_drake.segmentation.partition import partition, shared_area
from riseg_drake.segmentation.propagation import UNKNOWN
from riseg_drake.segmentation.told_apart import identity_costs


def first_belief(
    frame: Frame, above: AboveTable, noise: MeasurementNoise, parameters: BeliefParameters
) -> Belief:
    """Nothing has moved yet."""
    keyframe = make_keyframe(frame, above, noise, parameters.keyframe)
    prior = border_prior(keyframe, parameters.prior)
    part = partition(keyframe, prior, parameters.partition)
    return Belief(
        keyframe=keyframe,
        prior=prior,
        evidence=np.zeros(len(keyframe.borders)),
        alike=np.zeros(len(keyframe.borders)),
        inherited=np.zeros(len(keyframe.borders)),
        body=np.zeros(keyframe.count, np.intp),
        next_id=1,
        told=np.zeros((1, 1)),
        part=part,
        shown=freedoms_shown(keyframe.edges, frame.gray, part, keyframe.borders),
        finer=_finer(keyframe, prior, parameters),
    )


def next_belief(
    belief: Belief,
    seen: Observation | None,
    bodies: Bodies,
    frame: Frame,
    above: AboveTable,
    remembered: NDArray[np.uint16],
    noise: MeasurementNoise,
    parameters: BeliefParameters,
) -> Belief:
    """The belief, with what was seen, carried to a frame that becomes the keyframe.

    `remembered` [H, W] has ids where things that the old keyframe does not see should be now.
    """
    old = belief.keyframe
    moves = {s + 1: bodies.motions_K[g] for s, g in enumerate(bodies.motion) if g > 0}
    carried = carry_superpixels(
        belief, np.arange(old.count) + 1, moves, frame, above, np.zeros_like(remembered)
    )
    carried = np.where(carried == UNKNOWN, 0, carried).astype(np.intp)
    ids = np.append(bodies.body, 0)[carried - 1]
    ids = np.where((carried == 0) & (remembered != UNKNOWN), remembered, ids)
    new = make_keyframe(frame, above, noise, parameters.keyframe, ids)
    source = _most_seen(new, carried) - 1
    known = source >= 0
    if seen is not None:
        belief = belief.with_evidence(seen, parameters)
    body = np.where(known, bodies.body[source], _most_seen(new, np.where(carried == 0, ids, 0)))
    prior = border_prior(new, parameters.prior)
    in_sight = were_in_sight(old, new, source, bodies.motion[source], bodies.motions_K)
    origin = Origin(source, body, in_sight)
    evidence, alike, inherited = carried_evidence(
        replace(belief, body=bodies.body), new, prior, origin, parameters.inside
    )
    costs = identity_costs(bodies.told, body, new.area)
    part = partition(new, prior + evidence, parameters.partition, costs)
    body, next_id = with_arrivals(
        completed(body, known, part, new.area),
        part,
        have_come(old, new) & ~known & parameters.arrivals,
        new.area,
        parameters.partition.area_min * new.pixels_per_metre**2,
        bodies.next_id,
    )
    return Belief(
        keyframe=new,
        prior=prior,
        evidence=evidence,
        alike=alike,
        inherited=inherited,
        body=body,
        next_id=next_id,
        told=np.pad(bodies.told, (0, next_id - bodies.next_id)),
        part=part,
        shown=freedoms_shown(new.edges, frame.gray, part, new.borders),
        finer=_finer(new, prior + evidence, parameters, costs),
    )


def completed(
    body: NDArray[np.intp], known: NDArray[np.bool_], part: NDArray[np.intp], area: NDArray[np.intp]
) -> NDArray[np.intp]:
    """Ids [N], of which those that were not `known` [N] before take that of most of their part."""
    ids = shared_area(part, body, area, (int(part.max(initial=-1)) + 1, int(body.max(initial=0)) + 1))
    most = np.where(2 * ids.max(1) > ids.sum(1), ids.argmax(1), 0)
    return np.where(known | (body > 0), body, most[part])


def _finer(
    keyframe: Keyframe,
    bond: NDArray[np.float64],
    parameters: BeliefParameters,
    known: NDArray[np.float64] | None = None,
) -> NDArray[np.intp]:
    parts = [partition(keyframe, bond - by, parameters.partition, known) for by in parameters.weaker]
    return np.array(parts, np.intp).reshape(-1, keyframe.count)


def _most_seen(keyframe: Keyframe, image: NDArray[np.integer]) -> NDArray[np.intp]:
    """The value >= 0 of an image [H, W] that each superpixel [N] shows most."""
    label = keyframe.superpixels.label
    inside = label >= 0
    values = image[keyframe.region][inside].astype(np.intp)
    count = int(values.max(initial=0)) + 1
    code, pixels = np.unique(label[inside] * count + values, return_counts=True)
    owner, value = np.divmod(code, count)
    most = np.zeros(keyframe.count, np.intp)
    order = np.lexsort((pixels, owner))
    most[owner[order]] = value[order]
    return most
