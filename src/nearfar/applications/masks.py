"""Masks of probing: which projector pixels may light each camera pixel.

A mask is a sum of shapes with signs, so that a ring is a disc less a smaller one, and rings that
meet add up to the whole.
"""

from dataclasses import dataclass
from math import inf
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from nearfar.applications.shapes import Band, Disc
from nearfar.arrays import Floats, Size
from nearfar.checks import as_number, finite_numbers, real_numbers
from nearfar.errors import InputError


@dataclass(frozen=True)
class Whole:
    """All projector pixels."""


@dataclass(frozen=True, eq=False)
class SameForAll:
    """Weights of projector pixels, (Py, Px), the same for every camera pixel."""

    weights: NDArray[Any]


@dataclass(frozen=True, eq=False)
class Given:
    """Weights of projector pixels for each camera pixel, (C, P) or (Cy, Cx, Py, Px)."""

    weights: NDArray[Any]

    def rows(self, pixels: slice, camera: Size, projector: Size) -> Floats:
        """Return the weights of some camera pixels, (n, P).

        Raises
        ------
        InputError
            If they are not of these sizes, or not finite.
        """
        if self.weights.shape not in {(*camera, *projector), (camera.pixels, projector.pixels)}:
            shape = "x".join(map(str, self.weights.shape))
            raise InputError(
                f"the mask is {shape}: give {projector} weights of the projector's pixels, or "
                f"{camera.pixels} x {projector.pixels} of camera pixels by projector pixels."
            )
        flat = self.weights.reshape(camera.pixels, projector.pixels)
        return finite_numbers(flat[pixels], "the mask")


Shape = Whole | Disc | Band | SameForAll | Given


@dataclass(frozen=True, eq=False)
class ProbingMask:
    """Which projector pixels may light each camera pixel; see `nearfar.probe`.

    Make one by `within`, `ring`, `beyond`, `epipolar` or `of_matrix`. Distances are from q(c) to
    the middles of projector pixels, in projector pixels.

    Attributes
    ----------
    terms : tuple of (int, shape)
        Shapes and their signs; the mask is their sum.

    Examples
    --------
    >>> near_q = nearfar.ProbingMask.within(2)
    >>> elsewhere = nearfar.ProbingMask.beyond(2)
    >>> parts = [nearfar.probe(transport, light, mask) for mask in (near_q, elsewhere)]
    >>> bool(np.allclose(parts[0] + parts[1], transport @ light, atol=1e-5))
    True
    """

    terms: tuple[tuple[int, Shape], ...]

    @staticmethod
    def within(radius: float) -> "ProbingMask":
        """Allow what is nearer to q than `radius`; nothing at camera pixels without q.

        Parameters
        ----------
        radius : float
            Above 0, in projector pixels. If it is infinite, everything is allowed, also at camera
            pixels without q.

        Raises
        ------
        InputError
            If it is no such number.

        Examples
        --------
        >>> local = nearfar.probe(transport, light, nearfar.ProbingMask.within(1.5))
        """
        return ProbingMask(((1, Disc(_distance(radius, "radius", least=0.0))),))

    @staticmethod
    def ring(inner: float, outer: float) -> "ProbingMask":
        """Allow what is at least `inner` and less than `outer` from q.

        Camera pixels without q are at an infinite distance from all projector pixels: they get
        light by no ring of a finite outer radius, and all of it by `beyond`.

        Parameters
        ----------
        inner, outer : float
            Projector pixels, 0 or more; inner < outer. A ring whose outer radius is infinite has
            all that `beyond` the inner one has.

        Raises
        ------
        InputError
            If they are no such numbers.

        Examples
        --------
        >>> edges = [0, 1, 2, 4]
        >>> masks = [nearfar.ProbingMask.ring(*pair) for pair in zip(edges, edges[1:])]
        >>> by_distance = [nearfar.probe(transport, light, mask) for mask in masks]
        """
        inner = _distance(inner, "inner radius", least=None)
        outer = _distance(outer, "outer radius", least=inner)
        smaller = ((-1, Disc(inner)),) if inner else ()
        return ProbingMask(((1, Disc(outer)), *smaller))

    @staticmethod
    def beyond(radius: float) -> "ProbingMask":
        """Allow what is at least `radius` from q; everything at camera pixels without q.

        Parameters
        ----------
        radius : float
            Above 0, in projector pixels.

        Raises
        ------
        InputError
            If it is no such number.

        Examples
        --------
        >>> indirect = nearfar.probe(transport, light, nearfar.ProbingMask.beyond(1.5))
        """
        radius = _distance(radius, "radius", least=0.0)
        return ProbingMask(((1, Whole()), (-1, Disc(radius))))

    @staticmethod
    def epipolar(fundamental: ArrayLike, width: float) -> "ProbingMask":
        """Allow a band about the epipolar line of each camera pixel (O'Toole et al. 2014).

        Direct light comes from this line, and most indirect light does not.

        Parameters
        ----------
        fundamental : array_like, shape (3, 3)
            F such that a x + b y + c = 0 is the line of camera pixel (x_c, y_c), x across and y
            down, counted from the middle of the first pixel, with (a, b, c) = F (x_c, y_c, 1). It
            is what OpenCV's ``findFundamentalMat(camera_points, projector_points)`` returns. A
            camera pixel without a line, a = b = 0, gets no light.
        width : float
            Of the band, above 0, in projector pixels: half of it on each side of the line.

        Raises
        ------
        InputError
            If they are no such numbers.

        Examples
        --------
        >>> same_row = np.array([[0, 0, 0], [0, 0, -1], [0, 1, 0]])
        >>> mask = nearfar.ProbingMask.epipolar(same_row, 1)
        >>> on_the_line = nearfar.probe(transport, light, mask)
        """
        matrix = finite_numbers(fundamental, "the fundamental matrix").astype(np.float64)
        if matrix.shape != (3, 3):
            shape = "x".join(map(str, matrix.shape))
            raise InputError(f"the fundamental matrix is {shape or 'one number'}: give 3x3.")
        if not matrix[:2].any():
            raise InputError(
                "the fundamental matrix has zeros in its first two rows and makes no lines: give "
                "that of the camera and the projector."
            )
        return ProbingMask(((1, Band(matrix, _distance(width, "width", least=0.0))),))

    @staticmethod
    def of_matrix(weights: ArrayLike) -> "ProbingMask":
        """Multiply T entry by entry with any weights.

        Parameters
        ----------
        weights : array_like, shape (Py, Px), (C, P) or (Cy, Cx, Py, Px)
            Of projector pixels, the same for every camera pixel, or for each camera pixel. A memory
            map is read some camera pixels at a time.

        Raises
        ------
        InputError
            If they are not real numbers, or of another number of axes.

        Examples
        --------
        >>> left = np.zeros(size)
        >>> left[:, :4] = 1
        >>> by_left_half = nearfar.probe(transport, light, nearfar.ProbingMask.of_matrix(left))
        >>> bool(np.allclose(by_left_half, transport @ (light * left), atol=1e-5))
        True
        """
        array = real_numbers(weights, "the mask")
        if array.ndim not in (2, 4):
            raise InputError(
                f"the mask has {array.ndim} axes: give (Py, Px) weights of projector pixels, or "
                f"(C, P) or (Cy, Cx, Py, Px) of camera pixels by projector pixels."
            )
        return ProbingMask(((1, Given(array)),))

    def on(self, projector: Size) -> "ProbingMask":
        """Return the mask for a projector: a matrix of its size is the same for all camera pixels.

        Raises
        ------
        InputError
            If such a matrix is not finite.
        """
        terms = tuple((sign, _on(shape, projector)) for sign, shape in self.terms)
        return ProbingMask(terms)


def _on(shape: Shape, projector: Size) -> Shape:
    if isinstance(shape, Given) and shape.weights.shape == projector:
        return SameForAll(finite_numbers(shape.weights, "the mask"))
    return shape


def _distance(value: float, name: str, *, least: float | None) -> float:
    """Return a distance of 0 or more, above `least`; it may be infinite where `least` is given."""
    if least is not None and value == inf:
        return inf
    number = as_number(value, f"the {name}")
    if number < 0 or (least is not None and number <= least):
        raise InputError(
            f"the {name} is {number:g} projector pixels: give "
            f"{'0 or more' if least is None else f'more than {least:g}'}."
        )
    return number
