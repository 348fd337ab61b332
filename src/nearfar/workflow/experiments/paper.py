"""The experiments behind the paper's figures, by name."""

from collections.abc import Callable, Mapping
from functools import partial

from nearfar.callbacks import Report
from nearfar.workflow.experiments.acquired import BOX, CORNER, acquire_scene
from nearfar.workflow.experiments.compressive import acquire_compressively
from nearfar.workflow.experiments.data import Data
from nearfar.workflow.experiments.in_theory import WEDGE, acquire_in_theory
from nearfar.workflow.experiments.scan_line import components_along_a_line

EXPERIMENTS: Mapping[str, Callable[[Report], Data]] = {
    "box": partial(acquire_scene, BOX),
    "scan-line": partial(components_along_a_line, BOX),
    "corner": partial(acquire_scene, CORNER),
    "wedge": partial(acquire_in_theory, WEDGE),
    "CLT": partial(acquire_compressively, WEDGE),
}
