"""Poses of a board: the corners and q at them, from a capture of each."""

from dataclasses import dataclass

import numpy as np

from nearfar.arrays import Floats, Size
from nearfar.capture import Capture
from nearfar.errors import InputError
from nearfar.plan import Plan, paper_plan
from nearfar.workflow.depth import seen_in_capture, white_picture
from nearfar.workflow.geometry.board import LEAST_KNOWN, Board, find_corners, q_at_corners


@dataclass(frozen=True, eq=False)
class Pose:
    """A board as the camera and the projector see it.

    Attributes
    ----------
    name : str
        For messages.
    places : ndarray, shape (n, 3), float32
        Corners on the board.
    camera, projector : ndarray, shape (n, 2), float32
        The same in pixels, (x, y), of the camera and of the pattern grid.
    camera_size, projector_size : Size
    """

    name: str
    places: Floats
    camera: Floats
    projector: Floats
    camera_size: Size
    projector_size: Size


def plan_of_poses(projector: Size) -> Plan:
    """Return the plan that each pose is photographed by: Gray code with its inverse, and white.

    Parameters
    ----------
    projector : Size
        The projector's own pixels.
    """
    return paper_plan(projector, window=1, far=(1, 1), correspondence="gray")


def pose_in(capture: Capture, board: Board) -> Pose:
    """Find the corners of a board in a capture, and q at them.

    Parameters
    ----------
    capture : Capture
        Of any plan that tells q; corners are looked for in its photo under white.
    board : Board

    Raises
    ------
    InputError
        If the board or q at its corners is not seen.
    MissingPackageError
    """
    corners = find_corners(white_picture(capture).mean(axis=-1), board)
    if corners is None:
        raise InputError(
            f"no board of {board.corners} inner corners is seen in {capture.path}: show all of it "
            f"to camera and projector, flat and in focus, and check `board`."
        )
    q = q_at_corners(seen_in_capture(capture).correspondence.q, corners)
    known = np.flatnonzero(np.isfinite(q).all(axis=1))
    if len(known) < LEAST_KNOWN * len(q):
        raise InputError(
            f"q is known at {len(known)} of {len(q)} corners in {capture.path}: light the "
            f"board by the projector, and expose so that it is neither dark nor saturated."
        )
    return Pose(
        name=str(capture.path),
        places=board.places()[known],
        camera=corners[known].astype(np.float32),
        projector=q[known].astype(np.float32),
        camera_size=capture.camera,
        projector_size=capture.plan.projector,
    )
