"""Blocks of projector pixels that are cut into parts, and lit at once where they do not conflict.

Two blocks conflict if a camera pixel is asked about both of them: a photo of both would not tell
which of them lit it. What a camera pixel receives from blocks that it is not asked about is
predicted by the estimate so far, and subtracted.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from nearfar.arrays import Booleans, Floats, Integers, Size
from nearfar.baselines.shooting import Shooting
from nearfar.errors import InputError

# In photo units, about the noise of a dark photo: light below it is not told from none.
LEAST_LIGHT = 5e-4


class Block(NamedTuple):
    """A rectangle of projector pixels, `bottom` and `right` exclusive."""

    top: int
    bottom: int
    left: int
    right: int

    def pixels(self, projector: Size) -> Integers:
        """Return the flat indices of its pixels."""
        y, x = np.arange(self.top, self.bottom), np.arange(self.left, self.right)
        return np.asarray((y[:, None] * projector.width + x).ravel())

    @classmethod
    def whole(cls, projector: Size) -> "Block":
        """Return the block of all pixels."""
        return cls(0, projector.height, 0, projector.width)

    def parts(self) -> "list[Block]":
        """Cut it in half along both axes, as far as these are longer than a pixel.

        One pixel has no parts.
        """
        rows, columns = _halves(self.top, self.bottom), _halves(self.left, self.right)
        if len(rows) == len(columns) == 1:
            return []
        return [Block(*row, *column) for row in rows for column in columns]


def _halves(first: int, last: int) -> list[tuple[int, int]]:
    if last - first == 1:
        return [(first, last)]
    middle = (first + last + 1) // 2
    return [(first, middle), (middle, last)]


class Question(NamedTuple):
    """It asks what some camera pixels receive from each part of a block.

    Attributes
    ----------
    block : Block
    asked : ndarray, shape (n,)
        Flat indices of the camera pixels.
    """

    block: Block
    asked: Integers


class Answer(NamedTuple):
    """What some camera pixels receive from a part of a block.

    Attributes
    ----------
    block : Block
        The part.
    asked : ndarray, shape (n,)
        Flat indices of the camera pixels.
    received : ndarray, shape (n, channels)
        In photo units.
    """

    block: Block
    asked: Integers
    received: Floats


def ask(
    shooting: Shooting, questions: Sequence[Question], estimate: Floats, black: Floats
) -> list[Answer]:
    """Light parts of blocks, as many at once as do not conflict, until all are lit or photos end.

    What a camera pixel receives from the parts of a block is made to sum to what it is known to
    receive from the block; otherwise noise would grow with each cut. If the photos end before some
    parts are lit, these parts are taken to give the rest.

    Parameters
    ----------
    shooting : Shooting
    questions : sequence of Question
        Those of most light are asked first, should the photos end.
    estimate : ndarray, shape (channels, C, P)
        Of T, in photo units.
    black : ndarray, shape (C, channels)
        Photo under black.

    Returns
    -------
    list of Answer
    """
    projector = shooting.projector
    asked = _parts_of(questions, estimate, projector)
    groups = without_conflict([part for part, _ in asked], shooting.camera, shooting.left)
    if not groups:
        return []
    lights = np.zeros((len(groups), projector.pixels), dtype=np.float32)
    for light, group in zip(lights, groups, strict=True):
        for number in group:
            light[asked[number][0].block.pixels(projector)] = 1
    patterns = (255 * lights).astype(np.uint8).reshape(-1, *projector)
    residual = shooting.shoot(patterns) - black - np.moveaxis(estimate @ lights.T, (0, 2), (2, 0))
    news: dict[int, dict[Block, Floats]] = {}
    for rest, group in zip(residual, groups, strict=True):
        for number in group:
            part, question = asked[number]
            news.setdefault(question, {})[part.block] = rest[part.asked]
    return [
        answer
        for question, found in news.items()
        for answer in _answers(questions[question], found, estimate, projector)
    ]


def first_limit(shooting: Shooting, limit: float, fewest: int, method: str) -> float:
    """Return the limit of light with which a method begins, which halves it later on.

    Parameters
    ----------
    shooting : Shooting
    limit : float
        In photo units; less than `LEAST_LIGHT` counts as that.
    fewest : int
        Photos that the method takes before any block is cut.
    method : str
        Its name, for the message.

    Raises
    ------
    InputError
        If fewer photos may be taken, or the limit is below 0.
    """
    if shooting.left < fewest:
        raise InputError(
            f"{shooting.left} photos are too few for {method}: allow {fewest} or more."
        )
    if limit < 0:
        raise InputError(f"the limit of light for {method} is {limit}: give 0 or more.")
    return max(limit, LEAST_LIGHT)


def parts_or_itself(block: Block) -> list[Block]:
    """Return the parts of a block; of a single pixel itself."""
    return block.parts() or [block]


def _parts_of(
    questions: Sequence[Question], estimate: Floats, projector: Size
) -> list[tuple[Question, int]]:
    """List parts with the number of the question, those of the brightest block first."""
    light = [
        float(estimate[:, asked[:, None], block.pixels(projector)].sum())
        for block, asked in questions
    ]
    return [
        (Question(part, questions[number].asked), number)
        for number in np.argsort(light, kind="stable")[::-1].tolist()
        for part in parts_or_itself(questions[number].block)
    ]


def _answers(
    question: Question, found: dict[Block, Floats], estimate: Floats, projector: Size
) -> list[Answer]:
    """Add what was predicted to what was not, so that all parts sum to the block."""
    parts = question.block.parts()
    unlit = [part for part in parts if part not in found]
    total: Floats = np.sum(list(found.values()), axis=0)
    if unlit:
        # Photos ended before these: they give the rest.
        share = -total / sum(len(part.pixels(projector)) for part in unlit)
        found = found | {part: share * len(part.pixels(projector)) for part in unlit}
    elif parts:
        found = {part: rest - total / len(parts) for part, rest in found.items()}
    answers = []
    for part, rest in found.items():
        predicted = estimate[:, question.asked[:, None], part.pixels(projector)].sum(axis=2).T
        answers.append(Answer(part, question.asked, predicted + rest))
    return answers


def without_conflict(blocks: Sequence[Question], camera: Size, most: int) -> list[list[int]]:
    """Put blocks in groups that can be lit at once.

    Parameters
    ----------
    blocks : sequence of Question
        With the camera pixels that are asked about each. Each goes to the first group in which
        nothing conflicts with it.
    camera : Size
    most : int
        How many groups there may be.

    Returns
    -------
    list of list of int
        Numbers of blocks. Those that no group had a place for are left out.
    """
    taken: Booleans = np.zeros((camera.pixels, most), dtype=bool)
    groups: list[list[int]] = []
    for number, (_, asked) in enumerate(blocks):
        is_free = ~taken[asked, : len(groups) + 1].any(axis=0)
        if not is_free.any():
            continue
        place = int(is_free.argmax())
        if place == len(groups):
            groups.append([])
        groups[place].append(number)
        taken[asked, place] = True
    return groups
