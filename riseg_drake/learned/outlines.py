"""Sharper outlines: each object's mask prompts Segment Anything, and its answers are put together again.

The paper's section on SAM: masks that motion found, refined after each interaction. What the model says never
makes or loses an object: ids stay, and an answer that leaves its prompt behind is refused.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from riseg_drake.geometry.nearest import nearest_values
from riseg_drake.geometry.rgbd import Frame
from riseg_drake.learned.prompts import Answer, PromptedSegmenter, intersection_over_union, prompt_of_mask


@dataclass
class OutlineParameters:
    """How answers are asked for and judged. None is from the paper, which does not say."""

    points: int = 5
    """Points in a prompt."""
    with_mask: bool = False
    """Whether the mask itself is part of the prompt; users report that points and box alone do better."""
    iou_min: float = 0.6
    """An answer that agrees less with the mask that asked for it is refused."""
    depth_step: float = 0.004
    """m; where two answers claim a pixel, the object whose depth nearby fits better by more than this has it;
    otherwise the better score."""


@dataclass(frozen=True)
class _Claim:
    """What an object is to have."""

    mask: NDArray[np.bool_]
    score: float


def refine_outlines(
    frame: Frame,
    mask: NDArray[np.uint16],
    segmenter: PromptedSegmenter,
    parameters: OutlineParameters,
) -> NDArray[np.uint16]:
    """The mask [H, W] of a frame with the outlines that a prompted model gives, the same ids in it.

    Args:
        frame: the image that the mask belongs to.
        mask: L_t [H, W], ids, 0 = background.
        segmenter: the model.
        parameters: see there.
    """
    ids = [int(a) for a in np.unique(mask[mask > 0])]
    if not ids:
        return mask.copy()
    prompts = [prompt_of_mask(mask == a, parameters.points, parameters.with_mask) for a in ids]
    answers = segmenter(frame.color, prompts)
    claims = {
        a: _claim(mask == a, answer, frame.robot, parameters.iou_min)
        for a, answer in zip(ids, answers, strict=True)
    }
    refined = _settle(claims, frame.depth, parameters.depth_step)
    for a in ids:
        # Others have claimed it away. Its own pixels were nobody else's before: no other is worse off.
        if intersection_over_union(refined == a, mask == a) < parameters.iou_min:
            refined[refined == a] = 0
            refined[mask == a] = a
    return refined


def _claim(prompt: NDArray[np.bool_], answer: Answer, robot: NDArray[np.bool_], iou_min: float) -> _Claim:
    """Of a model's answers the one that agrees best with the prompt; if none does, the prompt itself."""
    masks = answer.masks & ~robot
    agreement = np.array([intersection_over_union(each, prompt) for each in masks])
    best = int(agreement.argmax())
    if agreement[best] < iou_min:
        return _Claim(prompt, score=0.0)
    return _Claim(masks[best], float(answer.scores[best]))


def _settle(claims: Mapping[int, _Claim], depth: NDArray[np.float32], depth_step: float) -> NDArray[np.uint16]:
    """One label image [H, W] of claims that may overlap."""
    claimed = np.sum([claim.mask for claim in claims.values()], axis=0)
    contested = claimed > 1
    label = np.zeros(depth.shape, np.uint16)
    for a, claim in claims.items():
        label[claim.mask & ~contested] = a
    if not contested.any():
        return label
    misfits = np.array(
        [_misfit(claim.mask, contested, depth)[contested] for claim in claims.values()]
    )  # [K, contested pixels], m
    scores = np.array([claim.score for claim in claims.values()])
    candidate = misfits <= misfits.min(0) + depth_step
    candidate &= np.isfinite(misfits)
    winner = np.where(candidate, scores[:, None], -np.inf).argmax(0)
    label[contested] = np.array(list(claims), np.uint16)[winner]
    return label


def _misfit(
    claim: NDArray[np.bool_], contested: NDArray[np.bool_], depth: NDArray[np.float32]
) -> NDArray[np.float64]:
    """By how much the depth of contested pixels [H, W], m, differs from that of a claim's nearest own pixel.

    Infinite outside the claim; 0 where no depth is known, so that it decides nothing there.
    """
    own = claim & ~contested & (depth > 0)
    if not own.any():
        return np.where(claim, 0.0, np.inf)
    nearest, _ = nearest_values(depth.astype(float), own, cv2.DIST_MASK_5)
    misfit = np.where(depth > 0, np.abs(depth - nearest), 0.0)
    return np.where(claim, misfit, np.inf)
