"""Symmetric photography: blocks of T of rank one, each seen from both of its sides.

After Garg, Talvala, Levoy and Lensch 2006, "Symmetric Photography: Exploiting Data-sparseness in
Reflectance Fields". Camera and projector share an axis and a pixel grid, so that T is symmetric.
Blocks a and b of pixels cut a block T_ab out of it. Light on b alone gives the sums of its rows, at
the camera pixels of a; light on a alone those of its columns, at the camera pixels of b, as
T_ba = T_ab^T. If T_ab is of rank one, it is their outer product, over its sum.

All blocks are cut into four, level by level. T_ab predicts what its parts receive. Where it does so
within a tolerance, it is not cut any more; blocks on the diagonal, which direct light fills, are
cut down to single pixels. Once all blocks are within the tolerance and photos are left, the
tolerance is halved, down to the noise of a dark photo. Blocks share a photo if no camera pixel is
asked about two of them; light that is known already is subtracted from it.

Index convention: a and b are blocks of one level.
"""

from collections.abc import Iterator, Mapping, Sequence
from itertools import product
from typing import NamedTuple

import numpy as np

from nearfar.arrays import Floats, Integers, Size
from nearfar.baselines.projector_blocks import (
    LEAST_LIGHT,
    Answer,
    Block,
    Question,
    ask,
    first_limit,
    parts_or_itself,
)
from nearfar.baselines.shooting import Shooting
from nearfar.errors import InputError
from nearfar.transport.exact import ExactTransport

FEWEST_PHOTOS = 3
# A block whose sum is below so many standard deviations of it is taken to be even: an outer product
# over next to nothing would be noise.
DEVIATIONS_OF_RANK_ONE = 5.0
NAME = "symmetric photography"

# Two blocks of one level, whose block of T is asked about together with its transpose.
Pair = tuple[Block, Block]


def symmetric_photography(shooting: Shooting, tolerance: float) -> ExactTransport:
    """Measure T by blocks of rank one, down to single pixels where the photos suffice.

    Parameters
    ----------
    shooting : Shooting
        Of a coaxial rig whose camera has the projector's pixels.
    tolerance : float
        In photo units: at first, blocks of T are cut only where what they foretell for their parts
        is off by more, root mean square. Less than the noise of a dark photo counts as that.

    Returns
    -------
    ExactTransport
        In photo units, all in `far`.

    Raises
    ------
    InputError
        If there are no photos for two of black and one of white, the tolerance is below 0, or the
        camera has other pixels than the projector.
    """
    tolerance = first_limit(shooting, tolerance, FEWEST_PHOTOS, NAME)
    projector = shooting.projector
    dark = np.zeros((2, *projector), dtype=np.uint8)
    one, other = shooting.shoot(dark)
    if shooting.camera != projector:
        raise InputError(
            f"the camera has {shooting.camera} pixels and the projector {projector}: symmetric "
            f"photography exchanges them, so give both the same pixels."
        )
    black, noise = (one + other) / 2, float(np.std(one - other)) / np.sqrt(2)
    light = (shooting.shoot(np.full((1, *projector), 255, dtype=np.uint8))[0] - black).T
    whole = Block.whole(projector)
    estimate = rank_one(light, light, noise)
    # What is left to be cut, with the error by which it was predicted.
    errors: dict[Pair, float] = {(whole, whole): np.inf}
    while errors and shooting.left and tolerance >= LEAST_LIGHT:
        pairs = [pair for pair, error in errors.items() if error > tolerance]
        if not pairs:
            tolerance /= 2
            continue
        received = _ask_about_parts(shooting, pairs, estimate, black)
        for pair in pairs:
            del errors[pair]
        for a, b in _parts_of_pairs(pairs):
            if _tells(received, (a, b), projector) and _tells(received, (b, a), projector):
                error = _refine(estimate, (a, b), received, projector, noise)
                if a.parts() or b.parts():
                    errors[a, b] = error
    return ExactTransport(projector, shooting.camera, (), (), estimate, NAME)


def rank_one(rows: Floats, columns: Floats, noise: float) -> Floats:
    """Return the blocks of rank one with given sums of rows and columns.

    Parameters
    ----------
    rows : ndarray, shape (channels, A)
    columns : ndarray, shape (channels, B)
    noise : float
        Standard deviation of each sum.

    Returns
    -------
    ndarray, shape (channels, A, B), float32
        Even, where the sum of the whole block is not well above its noise.
    """
    count = rows.shape[1], columns.shape[1]
    total = (rows.sum(axis=1) + columns.sum(axis=1)) / 2
    least = DEVIATIONS_OF_RANK_ONE * noise * np.sqrt(sum(count)) / 2
    is_clear = total > max(least, np.finfo(np.float32).tiny)
    over = np.where(is_clear, total, 1.0)[:, None, None]
    outer = rows[:, :, None] * columns[:, None, :] / over
    even = total[:, None, None] / (count[0] * count[1])
    return np.where(is_clear[:, None, None], outer, even).astype(np.float32)


class _Received(NamedTuple):
    """What camera pixels receive from a block: flat indices in order, and (n, channels)."""

    asked: Integers
    values: Floats

    def at(self, pixels: Integers) -> Floats:
        """Return the light at some of the camera pixels, (channels, n)."""
        return self.values[np.searchsorted(self.asked, pixels)].T


def _ask_about_parts(
    shooting: Shooting, pairs: Sequence[Pair], estimate: Floats, black: Floats
) -> dict[Block, _Received]:
    """Light the parts of all blocks, and see what those they are paired with receive."""
    partners: dict[Block, set[Block]] = {}
    for a, b in pairs:
        partners.setdefault(a, set()).add(b)
        partners.setdefault(b, set()).add(a)
    questions = []
    for block, others in partners.items():
        pixels = [other.pixels(shooting.projector) for other in others]
        questions.append(Question(block, np.sort(np.concatenate(pixels))))
    answers: dict[Block, list[Answer]] = {}
    for answer in ask(shooting, questions, estimate, black):
        answers.setdefault(answer.block, []).append(answer)
    return {block: _merged(found) for block, found in answers.items()}


def _tells(received: Mapping[Block, _Received], pair: Pair, projector: Size) -> bool:
    """Return whether all camera pixels of the first block were asked about the second."""
    seen, lit = pair
    return lit in received and bool(np.isin(seen.pixels(projector), received[lit].asked).all())


def _merged(answers: Sequence[Answer]) -> _Received:
    """Merge the answers about one block; a single pixel is also asked about by itself."""
    asked, first = np.unique(np.concatenate([each.asked for each in answers]), return_index=True)
    return _Received(asked, np.concatenate([each.received for each in answers])[first])


def _parts_of_pairs(pairs: Sequence[Pair]) -> Iterator[Pair]:
    """Yield the pairs of parts of pairs of blocks, each once."""
    for a, b in pairs:
        for one, other in product(parts_or_itself(a), parts_or_itself(b)):
            if a != b or one <= other:
                yield one, other


def _refine(
    estimate: Floats,
    pair: Pair,
    received: Mapping[Block, _Received],
    projector: Size,
    noise: float,
) -> float:
    """Put a block of rank one and its transpose into the estimate (channels, P, P).

    Returns
    -------
    float
        Root-mean-square error of its sums as the estimate predicted them, photo units; at most
        the root mean square of the sums themselves, as a dark block need not be known better.
    """
    a, b = (block.pixels(projector) for block in pair)
    rows, columns = received[pair[1]].at(a), received[pair[0]].at(b)
    before = estimate[:, a[:, None], b]
    sums = np.concatenate([rows, columns], axis=1)
    errors = sums - np.concatenate([before.sum(axis=2), before.sum(axis=1)], axis=1)
    block = rank_one(rows, columns, noise)
    estimate[:, b[:, None], a] = block.transpose(0, 2, 1)
    estimate[:, a[:, None], b] = block
    return float(np.sqrt(min(np.mean(errors**2), np.mean(sums**2))))
