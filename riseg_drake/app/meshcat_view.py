"""What a person sees in the browser beside the robot and the scene: the camera's picture with its masks, the
objects found, and the push under way.

Drake's own MeshcatVisualizer shows robot and scene. A Meshcat recording keeps motions and properties but
not changing shapes, so what changes shape is drawn anew under a name of its own, and the
recording keeps when it is visible.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray
from pydrake.common.value import AbstractValue
from pydrake.geometry import Meshcat
from pydrake.perception import BaseField, Fields, PointCloud
from pydrake.systems.framework import Context, EventStatus, LeafSystem

from riseg_drake.app.meshcat_push import draw_push
from riseg_drake.app.meshcat_stage import (
    BOARD,
    BOARD_SIZE,
    EYE,
    LABEL_HEIGHT,
    LABEL_LIFT,
    PANEL,
    PANEL_WIDTH,
    facing,
    on_stage,
    open_stage,
)
from riseg_drake.geometry.camera import Intrinsics, back_project
from riseg_drake.geometry.rgbd import NO_PAIR, Frame, FramePair
from riseg_drake.pictures.cards import board, set_card, text_card, with_caption
from riseg_drake.pictures.masks import draw_masks
from riseg_drake.pictures.object_colors import object_colors
from riseg_drake.pushing.arm_path import ArmPhase
from riseg_drake.pushing.push import NO_PUSH, Push
from riseg_drake.robot.tool_shape import ToolShape
from riseg_drake.segmentation.segmentation import Segmentation, nothing_segmented

POINT_COLUMNS = 213
"""About so many columns of pixels become points: every third at 640x480, which makes 34 thousand."""
POINT_SIZE = 0.010
"""Meshcat draws points as wide as that under a field of view of 90 degrees, m; through a longer lens they are
the smaller for it: 4 mm here."""
POINT_LIFT = 0.006
"""How far above a thing its points are drawn, m: within its mesh half of them would be hidden."""
TINT = 0.7
"""How much of an object's colour lies over its points; the rest is how bright the camera sees them."""
GAMMA = 2.2
"""Of the camera's pictures."""
PICTURE_RATE = 2.0
"""How often the picture is renewed, 1/s."""
PANEL_LIFT = 5e-5
"""By how much each picture is nearer to who looks than the one before, m, so that it covers that."""
PICTURE_WIDTH = 400
"""Of the panel's picture, pixels."""
BOARD_WIDTH = 480
"""Of the list of objects, pixels."""
SMALL, DIFFERENT = (80, 60), 8
"""Two pictures of which no pixel differs by so many gray levels, shrunk to that size, look alike."""


@dataclass(frozen=True)
class Stage:
    """What the view is to know of the scene around it."""

    centre_W: Sequence[float]
    """Middle of the work area on the table, x and y, m."""
    tool: ToolShape
    has_things: bool = False
    """Whether something else draws table and things, so that the points need to be those of the masks only."""


@dataclass(frozen=True)
class Points:
    """What the camera sees, as points."""

    p_WQ: NDArray[np.float64]
    """[N, 3], m."""
    ids: NDArray[np.uint16]
    """[N], of the objects; 0: of none."""
    colors: NDArray[np.uint8]
    """[N, 3], tinted in the colours of the ids."""

    @property
    def of_objects(self) -> "Points":
        """Those of objects only."""
        seen = self.ids > 0
        return Points(self.p_WQ[seen], self.ids[seen], self.colors[seen])

    def cloud(self, lift: float) -> PointCloud:
        """All of them, those of objects `lift` m higher."""
        cloud = PointCloud(len(self.ids), Fields(BaseField.kXYZs | BaseField.kRGBs))
        cloud.mutable_xyzs()[:] = self.p_WQ.T
        cloud.mutable_xyzs()[2] += lift * (self.ids > 0)
        # Meshcat takes a point's colour for linear light, and shows it brighter than meant.
        cloud.mutable_rgbs()[:] = (255 * (self.colors.T / 255) ** GAMMA).astype(np.uint8)
        return cloud

    def tops(self) -> Mapping[int, NDArray[np.float64]]:
        """By object id, the point [3], m, in the middle of what is seen of it, at the height of its top."""
        tops = {}
        for object_id in np.unique(self.ids[self.ids > 0]):
            p_WQ = self.p_WQ[self.ids == object_id]
            # The median of places, and nearly the highest height: single points lie anywhere.
            tops[int(object_id)] = np.array([*np.median(p_WQ[:, :2], axis=0), np.percentile(p_WQ[:, 2], 95)])
        return tops


def points_of(frame: Frame, mask: NDArray) -> Points:
    """Some pixels of a frame, in even steps, that have depth and are not the robot's, under its mask [H, W]."""
    stride = max(1, round(frame.depth.shape[1] / POINT_COLUMNS))
    depth, color, robot, ids = (
        np.ascontiguousarray(image[::stride, ::stride])
        for image in (frame.depth, frame.color, frame.robot, mask)
    )
    camera = frame.intrinsics
    smaller = Intrinsics(
        depth.shape[1],
        depth.shape[0],
        *(value / stride for value in (camera.fx, camera.fy, camera.cx, camera.cy)),
    )
    seen = (depth > 0) & ~robot
    p_CQ = back_project(depth, smaller)[seen]
    gray = color.mean(axis=-1, keepdims=True)
    tinted = np.where(ids[..., None] > 0, TINT * object_colors(ids) + (1 - TINT) * gray, color)
    return Points(p_CQ @ frame.X_WC[:3, :3].T + frame.X_WC[:3, 3], ids[seen], tinted[seen].astype(np.uint8))


@dataclass(frozen=True, eq=False)
class _Sight:
    """What a person would see a difference in."""

    small: NDArray[np.uint8]
    """The camera's picture, so small that its noise is gone."""
    mask: NDArray
    words: tuple[str, ...]

    @classmethod
    def of(cls, frame: Frame, segmentation: Segmentation, caption: str) -> "_Sight":
        small = cv2.resize(frame.color, SMALL, interpolation=cv2.INTER_AREA)
        return cls(small.astype(np.uint8), segmentation.mask, (caption, *label_texts(segmentation).values()))

    def looks_like(self, other: "_Sight | None") -> bool:
        """Whether it need not be drawn again."""
        return (
            other is not None
            and self.words == other.words
            and np.array_equal(self.mask, other.mask)
            and int(cv2.absdiff(self.small, other.small).max()) < DIFFERENT
        )


class MeshcatView(LeafSystem):
    """Draws the camera's picture with its masks, the points of the objects, their labels, and the push.

    Inputs: `pair` (FramePair), `segmentation` (Segmentation), `active_push` (Push),
    `interaction_step` (int), `phase` (ArmPhase). Looks at every `period` s that it is given.
    What it remembers is what the browser shows.
    """

    def __init__(self, meshcat: Meshcat, period: float, stage: Stage):
        super().__init__()
        self.set_name("MeshcatView")
        self._meshcat, self._stage = meshcat, stage
        self._visible: dict[str, str] = {}  # by kind ("panel", "push" and so on), the path that is shown now
        self._drawn: set[str] = set()  # the labels that there are, shown or not
        self._boards: dict[tuple[str, ...], str] = {}  # the path of each list of objects that there is
        self._labelled: set[int] = set()  # ids that have, or had, a label
        self._sequence = -1
        self._sight: _Sight | None = None
        self._number = 0  # of the pictures that were shown
        self._push = NO_PUSH
        self._is_open = False
        for name, model in (
            ("pair", NO_PAIR),
            ("segmentation", nothing_segmented((0, 0))),
            ("active_push", NO_PUSH),
            ("interaction_step", 0),
            ("phase", ArmPhase.OBSERVE),
        ):
            self.DeclareAbstractInputPort(name, AbstractValue.Make(model))
        # A whole number of pictures, so that the view's moments are moments of the camera.
        pictures = max(1, round(1 / (PICTURE_RATE * period)))
        self.DeclarePeriodicPublishEvent(pictures * period, 0.0, self._publish)

    def _publish(self, context: Context) -> EventStatus:
        pair: FramePair = self.GetInputPort("pair").Eval(context)
        segmentation: Segmentation = self.GetInputPort("segmentation").Eval(context)
        step: int = self.GetInputPort("interaction_step").Eval(context)
        phase: ArmPhase = self.GetInputPort("phase").Eval(context)
        push: Push = self.GetInputPort("active_push").Eval(context)
        time = context.get_time()
        if not self._is_open:
            self._open(time)
        # At a tick both are of the frame before; a pair without its mask yet is left for the next tick.
        if self._sequence != pair.current.sequence == segmentation.sequence:
            caption = caption_of(step if phase is ArmPhase.OBSERVE else step + 1, phase, segmentation)
            sight = _Sight.of(pair.current, segmentation, caption)
            # While somebody is asked whether to push, say, a replay need not grow.
            if not sight.looks_like(self._sight):
                self._show(pair.current, segmentation, caption, time)
                self._sight = sight
            self._sequence = segmentation.sequence
        self._show_push(push, step, time)
        return EventStatus.Succeeded()

    def show_end(self, context: Context) -> None:
        """Show what was decided last, and that nothing more comes; of the whole diagram's context."""
        mine = self.GetMyContextFromRoot(context)
        pair: FramePair = self.GetInputPort("pair").Eval(mine)
        segmentation: Segmentation = self.GetInputPort("segmentation").Eval(mine)
        step: int = self.GetInputPort("interaction_step").Eval(mine)
        if pair is NO_PAIR or pair.current.sequence != segmentation.sequence:
            return
        time = context.get_time()
        if not self._is_open:
            self._open(time)
        self._show(pair.current, segmentation, ending_of(step, segmentation), time)
        self._show_push(NO_PUSH, step, time)

    def _show(self, frame: Frame, segmentation: Segmentation, caption: str, time: float) -> None:
        self._number += 1
        self._show_panel(frame, segmentation, caption, time)
        points = points_of(frame, segmentation.mask)
        self._show_points(points, time)
        self._show_labels(points, segmentation, time)
        self._show_board(segmentation, time)

    def _show_push(self, push: Push, step: int, time: float) -> None:
        if push is not self._push:
            self._push = push
            path = f"/riseg/push/step_{step}" if push is not NO_PUSH else ""
            if push is not NO_PUSH:
                draw_push(self._meshcat, path, push, self._stage.tool)
            self._turn_to("push", path, time)

    def _open(self, time: float) -> None:
        self._is_open = True
        self._start = time
        open_stage(self._meshcat, self._stage.centre_W)

    def _show_panel(self, frame: Frame, segmentation: Segmentation, caption: str, time: float) -> None:
        path = f"/riseg/panel/{self._number}"
        set_card(self._meshcat, path, panel_picture(frame, segmentation, caption), PANEL_WIDTH)
        place = PANEL + self._number * PANEL_LIFT * (EYE - PANEL) / np.linalg.norm(EYE - PANEL)
        self._meshcat.SetTransform(path, facing(on_stage(self._stage.centre_W, place)))
        # Behind a new picture the two before it stay: a busy browser takes a second to read one.
        self._turn_to(f"panel {self._number % 3}", path, time)

    def _show_points(self, points: Points, time: float) -> None:
        path = f"/riseg/points/{self._number}"
        if self._stage.has_things:
            points = points.of_objects
        self._meshcat.SetObject(path, points.cloud(POINT_LIFT), POINT_SIZE)
        self._turn_to("points", path, time)

    def _show_labels(self, points: Points, segmentation: Segmentation, time: float) -> None:
        tops = points.tops()
        labels = label_texts(segmentation)
        self._labelled |= set(tops)
        for object_id in self._labelled:
            text = labels.get(object_id, "") if object_id in tops else ""
            path = f"/riseg/labels/{object_id}/{text.replace(' ', '_')}" if text else ""
            if text:
                if path not in self._drawn:
                    self._drawn.add(path)
                    card = text_card(text, object_id)
                    set_card(self._meshcat, path, card, LABEL_HEIGHT * card.shape[1] / card.shape[0])
                self._meshcat.SetTransform(path, facing(tops[object_id] + [0.0, 0.0, LABEL_LIFT]), time)
            self._turn_to(f"label {object_id}", path, time)

    def _show_board(self, segmentation: Segmentation, time: float) -> None:
        """What the labels say, as a list: things hide each other, and their labels are small."""
        title, texts = count_of(segmentation), label_texts(segmentation)
        words = (title, *texts.values())
        if not texts:
            self._turn_to("board", "", time)
            return
        if words not in self._boards:
            path = self._boards[words] = f"/riseg/board/{len(self._boards) + 1}"
            width, height = BOARD_SIZE
            card = board(title, texts, (round(BOARD_WIDTH * height / width), BOARD_WIDTH))
            set_card(self._meshcat, path, card, width)
            self._meshcat.SetTransform(path, facing(on_stage(self._stage.centre_W, BOARD)))
        self._turn_to("board", self._boards[words], time)

    def _turn_to(self, kind: str, path: str, time: float) -> None:
        """Show one path of a kind instead of the one that was shown until now."""
        before = self._visible.get(kind, "")
        if path == before:
            return
        if before:
            self._meshcat.SetProperty(before, "visible", False, time)
        if path:
            if time > self._start:  # in the replay it is not there from the beginning
                self._meshcat.SetProperty(path, "visible", False, self._start)
            self._meshcat.SetProperty(path, "visible", True, time)
        self._visible[kind] = path


def caption_of(interaction: int, phase: ArmPhase, segmentation: Segmentation) -> str:
    """Where the run is, in one line."""
    return f"interaction {interaction}, {phase.value}: {count_of(segmentation)}"


def ending_of(interactions: int, segmentation: Segmentation) -> str:
    """That a run is over, in one line."""
    return f"ended after {interactions} interaction{'' if interactions == 1 else 's'}: {count_of(segmentation)}"


def count_of(segmentation: Segmentation) -> str:
    """How many objects were found, in words."""
    number = len(segmentation.object_ids)
    return f"{number} {'object' if number == 1 else 'objects'} found"


def label_texts(segmentation: Segmentation) -> dict[int, str]:
    """By object id: the id, how sure it is, and whether that is too little; or that no rest has decided yet."""
    texts, confidence = {}, segmentation.confidence
    for a in sorted({*segmentation.object_ids, *confidence}):
        if a not in confidence:
            texts[a] = f"{a}  not decided"
            continue
        state = "" if segmentation.margin[a] >= segmentation.settled else "  in doubt"
        texts[a] = f"{a}  {100 * confidence[a]:.0f} %{state}"
    return texts


def panel_picture(frame: Frame, segmentation: Segmentation, caption: str) -> NDArray[np.uint8]:
    """The camera's picture with its masks [H, W, 3], above its caption."""
    width = min(PICTURE_WIDTH, frame.color.shape[1])
    size = (width, frame.color.shape[0] * width // frame.color.shape[1])
    color = cv2.resize(frame.color, size, interpolation=cv2.INTER_AREA)
    mask = cv2.resize(segmentation.mask, size, interpolation=cv2.INTER_NEAREST)
    return with_caption(draw_masks(color, mask), caption)
