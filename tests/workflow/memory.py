"""Memory that cuts a camera as a test asks."""

from nearfar.workflow import blocks
from nearfar.workflow.methods import ESTIMATORS


def memory_for(rows, plan, camera, method="paper", channels=3):
    """Memory in which so many rows of the camera are worked at."""
    estimator = ESTIMATORS[method]
    shared, pixel = estimator.bytes_of(plan, channels)
    shared += blocks._bytes_of_references(plan, camera.pixels * channels)
    beside = 2 * (estimator.halo + 1) if estimator.halo else 0
    row = blocks.SLACK * pixel * camera.width
    return int(blocks.LIBRARIES + shared + row * (rows + beside + 0.5))
