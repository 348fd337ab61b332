"""Memory that cuts a camera into tiles as a test asks."""

from nearfar.estimate.base import ESTIMATORS
from nearfar.workflow.reconstruction.tiles import memory_of_tile


def memory_for(rows, plan, camera, method="paper", channels=3):
    """Memory in which so many rows of the camera are worked at, and not one more."""
    return int(memory_of_tile(plan, camera, channels, ESTIMATORS[method], rows + 0.5))
