"""Adaptive dual photography: blocks of the projector, cut where they light something.

After Sen and others 2005, "Dual Photography", section on adaptive multiplexed illumination. The
whole projector is cut into four blocks, these into four, and so on. Of each block, the camera
pixels that receive more than a threshold from it are asked about its parts; the others keep what
they received as light that is spread evenly over the block. Blocks that no camera pixel is asked
about together are lit in one photo.

Where all are answered and photos are left, the threshold is halved, until a photo's own noise would
exceed it; where the photos end, all keep what they know. Light that a camera pixel receives from
blocks that it is not asked about is foretold as evenly spread, and subtracted.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from nearfar.arrays import Floats, Integers
from nearfar.baselines.projector_blocks import Block, Question, ask
from nearfar.baselines.shooting import Shooting
from nearfar.errors import InputError
from nearfar.transport.exact import ExactTransport

FEWEST_PHOTOS = 2
# In photo units; about the noise of a dark photo.
LEAST_THRESHOLD = 5e-4


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
        In photo units: what a camera pixel must receive from a block, in any channel, to be asked
        about its parts, at first.

    Returns
    -------
    ExactTransport
        In photo units, all in `far`.

    Raises
    ------
    InputError
        If there are no photos for black and white, or the threshold is below 0.
    """
    if shooting.left < FEWEST_PHOTOS or threshold < 0:
        raise InputError(
            f"{shooting.left} photos and a threshold of {threshold} do not do for adaptive dual "
            f"photography: allow {FEWEST_PHOTOS} photos or more, and 0 or more."
        )
    projector = shooting.projector
    whole = Block(0, projector.height, 0, projector.width)
    levels = np.stack([np.zeros(projector, np.uint8), np.full(projector, 255, np.uint8)])
    black, white = shooting.shoot(levels)
    light = white - black
    estimate = np.repeat(light.T[:, :, None] / projector.pixels, projector.pixels, axis=2)
    known = [_Known(whole, np.arange(len(light)), light.max(axis=1))]
    while shooting.left and threshold >= LEAST_THRESHOLD:
        questions, known = _about_parts(known, threshold)
        if not questions:
            threshold /= 2
            continue
        for block, asked, received in ask(shooting, questions, estimate, black):
            lit = block.pixels(projector)
            estimate[:, asked[:, None], lit] = received.T[:, :, None] / len(lit)
            known.append(_Known(block, asked, received.max(axis=1)))
    name = "adaptive dual photography"
    return ExactTransport(projector, shooting.camera, (), (), estimate, name)


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
