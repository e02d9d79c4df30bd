"""The end effector as a push needs to know it: a vertical tip, rectangular from below."""

from dataclasses import dataclass, field, replace

from riseg_drake.robot.tool_shape import ToolShape


@dataclass
class PusherParameters:
    """Where the tool's lower end goes, and what room it is given."""

    margin: float = field(default=0.005, metadata={"least": 0.0, "most": 0.05})
    """Room that must be left around the tool, m."""
    tip_height: float = field(default=0.008, metadata={"least": 0.0, "most": 0.2})
    """Height of the end face above the table during a push, m, unless the object is too low for it."""
    lowest_tip_height: float = field(default=0.002, metadata={"least": 0.0, "most": 0.05})
    """The end face never goes below this height, m: plane fit, arm and table have their errors. Nothing lower
    than this over `height_share` is pushed (4.4 mm)."""
    height_share: float = field(default=0.45, metadata={"least": 0.05, "most": 1.0})
    """The end face is at most at this share of the object's height where it is touched, so that even
    something round is met at or below its widest level."""


@dataclass(frozen=True)
class Pusher:
    """A tool with these. E is the centre of its end face."""

    tool: ToolShape
    parameters: PusherParameters = field(default_factory=PusherParameters)

    def turned(self) -> "Pusher":
        """The same tool, pushing with its back."""
        return replace(self, tool=self.tool.turned())
