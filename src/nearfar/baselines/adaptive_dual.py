"""Adaptive dual photography: blocks of the projector, cut where they light something.

After Sen and others 2005, "Dual Photography", section on adaptive multiplexed illumination. The
whole projector is cut into four blocks, these into four, and so on. Of each block, the camera
pixels that receive more than a threshold from it are asked about its parts; the others keep what
they received as light that is spread evenly over the block. Blocks share a photo if no camera pixel
is asked about two of them.

Once all questions are answered and photos are left, the threshold is halved, down to the noise of a
dark photo. When the photos end, all camera pixels keep what they know. Light that a camera pixel
receives from blocks that it is not asked about is predicted as evenly spread, and subtracted.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from nearfar.arrays import Floats, Integers
from nearfar.baselines.projector_blocks import LEAST_LIGHT, Block, Question, ask, first_limit
from nearfar.baselines.shooting import Shooting
from nearfar.transport.exact import ExactTransport

FEWEST_PHOTOS = 2
NAME = "adaptive dual photography"


class _Known(NamedTuple):
    """What some camera pixels, of flat indices `asked`, receive from a block, in any channel."""

    block: Block
    asked: Integers
    received: Floats


def adaptive_dual(shooting: Shooting, threshold: float) -> ExactTransport:
    """Measure T by blocks, down to single pixels where the photos suffice.

    Parameters
    ----------
    shooting : Shooting
    threshold : float
        In photo units: at first, a camera pixel is asked about the parts of blocks from which it
        receives more than this, in any channel. Less than the noise of a dark photo counts as that.

    Returns
    -------
    ExactTransport
        In photo units, all in `far`.

    Raises
    ------
    InputError
        If there are no photos for black and white, or the threshold is below 0.
    """
    threshold = first_limit(shooting, threshold, FEWEST_PHOTOS, NAME)
    projector = shooting.projector
    levels = np.stack([np.zeros(projector, np.uint8), np.full(projector, 255, np.uint8)])
    black, white = shooting.shoot(levels)
    light = white - black
    estimate = np.repeat(light.T[:, :, None] / projector.pixels, projector.pixels, axis=2)
    known = [_Known(Block.whole(projector), np.arange(len(light)), light.max(axis=1))]
    while shooting.left and threshold >= LEAST_LIGHT:
        questions, known = _about_parts(known, threshold)
        if not questions:
            threshold /= 2
            continue
        for block, asked, received in ask(shooting, questions, estimate, black):
            lit = block.pixels(projector)
            estimate[:, asked[:, None], lit] = received.T[:, :, None] / len(lit)
            known.append(_Known(block, asked, received.max(axis=1)))
    return ExactTransport(projector, shooting.camera, (), (), estimate, NAME)


def _about_parts(known: Sequence[_Known], threshold: float) -> tuple[list[Question], list[_Known]]:
    """Ask about the parts of blocks that give more than a threshold; also return what is left."""
    questions, left = [], []
    for block, asked, received in known:
        above = received > threshold
        if not block.parts():
            continue
        if above.any():
            questions.append(Question(block, asked[above]))
        if not above.all():
            left.append(_Known(block, asked[~above], received[~above]))
    return questions, left
