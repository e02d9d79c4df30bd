"""The paper's bar, by hand: 20 x 30 mm, 30 cm long, and nothing beside it."""

from riseg_drake.robot.tool_shape import ToolShape

BAR = ToolShape(thickness=0.02, width=0.03, length=0.30)
