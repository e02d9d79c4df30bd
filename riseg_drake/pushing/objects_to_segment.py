"""Alg. 3, lines 3 to 5: what stands on the table and has no object id yet."""

from dataclasses import dataclass, replace

import cv2
import numpy as np
from numpy.typing import NDArray

from riseg_drake.pushing.table_map import TableMap


@dataclass
class ObjectsToSegmentParameters:
    """What is too small to be an object. The paper asks for a mask without a single pixel left, which
    no segmentation with real outlines ever reaches."""

    minimum_area: float = 3e-4
    """Connected area, m^2, from which on a thing counts as an object to segment."""
    rim: float = 0.006
    """Unsegmented cells this close to a segmented object, m, may be its outline: they do not count
    towards the minimum area."""


def things_to_push(
    table: TableMap, parameters: ObjectsToSegmentParameters | None = None
) -> tuple[NDArray[np.bool_], NDArray[np.int_]]:
    """objsToSegment [rows, columns] in two: what has never moved, and the ids of what has and is in doubt.

    Slivers and specks are in neither, and slivers of what is in doubt do not count as things that never moved.
    """
    parameters = parameters or ObjectsToSegmentParameters()
    doubtful = np.zeros(table.objects.shape, int) if table.doubtful is None else table.doubtful
    unmoved = objects_to_segment(replace(table, segmented=table.segmented | (doubtful > 0)), parameters)
    large = np.bincount(doubtful[doubtful > 0], minlength=1) * table.cell_area >= parameters.minimum_area
    return unmoved, np.where((doubtful > 0) & large[doubtful], doubtful, 0)


def objects_to_segment(
    table: TableMap, parameters: ObjectsToSegmentParameters | None = None
) -> NDArray[np.bool_]:
    """objsToSegment = objMask - binL on the map, [rows, columns], without slivers and specks.

    A connected piece stays, with the part of it that lies within a rim of segmented objects, if the
    part beyond those rims is large enough.
    """
    parameters = parameters or ObjectsToSegmentParameters()
    remaining = table.objects & ~table.segmented
    if not remaining.any():
        return remaining
    if table.segmented.any():
        to_segmented = cv2.distanceTransform((~table.segmented).astype(np.uint8), cv2.DIST_L2, 5)
        core = remaining & (to_segmented * table.cell > parameters.rim)
    else:
        core = remaining
    # Single cells without depth must not cut an object in two.
    bridged = cv2.morphologyEx(core.astype(np.uint8), cv2.MORPH_CLOSE, np.ones((3, 3), np.uint8))
    _, pieces = cv2.connectedComponents(bridged, connectivity=8)
    area = np.bincount(pieces[core], minlength=pieces.max() + 1) * table.cell_area
    large = area >= parameters.minimum_area
    large[0] = False
    kept = core & large[pieces]
    if not kept.any():
        return kept
    # Back to the full outline: the part in the rim that hangs on to a piece that stays.
    to_kept = cv2.distanceTransform((~kept).astype(np.uint8), cv2.DIST_L2, 5)
    return remaining & (to_kept * table.cell <= parameters.rim)
