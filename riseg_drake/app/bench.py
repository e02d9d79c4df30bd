"""`riseg bench`: what each stage of Alg. 2 costs in time and memory."""

import tracemalloc
from collections import defaultdict
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np
from pydrake.systems.framework import Context
from rich.console import Console

from riseg_drake.app.diagram import Segmentation, make_diagram, make_segmentation
from riseg_drake.app.graphics import require_graphics
from riseg_drake.app.interactions import Progress, interactions
from riseg_drake.app.output import stage_figures
from riseg_drake.app.run import peak_memory_mb
from riseg_drake.app.scenario import Scenario, load_scenario
from riseg_drake.app.tables import stage_table
from riseg_drake.geometry.rgbd import Frame
from riseg_drake.pushing.push import ArmPhase
from riseg_drake.systems.stage_clock import StageClock
