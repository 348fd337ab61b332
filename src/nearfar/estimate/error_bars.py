"""Error bars: the posterior standard deviation of D, of entries of N and F, and of pictures.

All of them are linear functionals of a camera pixel's row, whose posterior is a Gaussian: that of
the joint estimate, of the estimate from any patterns, or of free rows.

Index convention: arrays are (n, channels, ...), n camera pixels or functionals of one of them.
"""

from collections.abc import Callable, Sequence
from typing import Protocol

import numpy as np

from nearfar.arrays import Floats, Integers, blocks
from nearfar.errors import InputError
from nearfar.estimate.any_patterns.error_bars import PatternVariances
from nearfar.estimate.free_rows.error_bars import FreeVariances
from nearfar.estimate.joint.error_bars import JointVariances
from nearfar.estimate.truncated import LEAST_LEFT
from nearfar.parallel import side_by_side
from nearfar.transport import near
from nearfar.transport.boxes import box_axes
from nearfar.transport.components import Components
from nearfar.transport.direct import footprint
from nearfar.transport.gains import Gains, gains_on, why_unjudgeable
from nearfar.transport.model import Transport
from nearfar.transport.posterior import FreePosterior, PatternPosterior

# Camera pixels of a batch, under one light.
BATCH_PIXELS = 2048
# Lights under which errors are computed together: so many at most, and fewer where they or their
# pictures have many values.
LIGHTS_TOGETHER, VALUES_TOGETHER = 8, 2**24
# Smaller shares of a footprint are rounding.
SHARE_FLOOR = 1e-9
# Entries of a row whose variance is computed at once.
ENTRIES_AT_ONCE = 2**14


class Variances(Protocol):
    """Posterior variances of a transport's rows, in squares of photo units."""

    def of_pictures(self, lights: Floats, gains: Gains) -> Callable[[slice], Floats]:
        """Return a function of camera pixels: variances (n, h, channels) under lights (h, P)."""
        ...

    def change_by_place(self, light: Floats, gains: Gains) -> Callable[[slice], Floats]:
        """Return a function of camera pixels: corrections of these variances, (n, channels).

        Squared error bars are the variances plus these; see `nearfar.estimate.truncated`.
        """
        ...

    def of_direct(self, batch: slice) -> Floats:
        """Return the variances of d at camera pixels, (n, channels)."""
        ...

    def of_window(self, pixel: int, values: Floats) -> Floats:
        """Return those of sums of one camera pixel's near-range functions, (m, channels).

        Parameters
        ----------
        pixel : int
        values : ndarray, shape (m, J)
            Weights of the functions in each sum.
        """
        ...

    def of_far(self, pixel: int, lines: slice) -> Floats:
        """Return those of one camera pixel's row of F on projector rows, (lines * Px, channels).

        Of free rows, which take the place of F, those of the light from each lamp.
        """
        ...


def _variances_of(transport: Transport) -> Variances:
    """Return the posterior variances of a transport's rows, of whichever estimate they are."""
    posterior = transport.posterior
    if posterior is None:
        if why_unjudgeable(transport.provenance) is not None:
            cure = (
                "it was changed after it was reconstructed. Take those of the transport as it was."
            )
        elif "free" in transport.parts:
            cure = (
                "its photos do not tell their own noise. Take some patterns twice, such as black "
                "and white, or give reference photos of several lamps, and make the transport "
                "again."
            )
        else:
            cure = "reconstruct a capture with `method='joint'`."
        raise InputError(f"this transport holds no error bars: {cure}")
    if isinstance(posterior, FreePosterior):
        return FreeVariances(transport, posterior)
    if isinstance(posterior, PatternPosterior):
        return PatternVariances(transport, posterior)
    return JointVariances(transport, posterior)


class ErrorBars:
    """Posterior standard deviations of a transport.

    They cover the photos' noise and what was never measured, for rows as the prior components of
    `nearfar.priors` expect them and q as it was found. Where held-out photos showed larger errors,
    they are multiplied by the ``widening`` of the transport's verdict. Those of components are of
    the model's split (d at q, n in the window, f in the band), not of the physical one.

    Where a camera pixel is saturated under white, nothing is known of its light: its standard
    deviations are infinite. Means over a picture leave such pixels out,
    ``sigma[numpy.isfinite(sigma)]``, and weights of 1 / sigma^2 are 0 there.

    Parameters
    ----------
    transport : Transport
        From a joint estimate, from photos of any patterns, or of free rows.

    Raises
    ------
    InputError
        If the transport holds no posterior.

    Examples
    --------
    >>> bars = nearfar.ErrorBars(transport)
    >>> bars.picture(light).shape  # the standard deviation of `transport @ light`
    (8, 8)
    """

    def __init__(self, transport: Transport) -> None:
        self._variances = _variances_of(transport)
        self._transport = transport
        self._widening = transport.verdict.widening if transport.verdict is not None else 1.0
        self._where = footprint(transport.correspondence, transport.projector)
        self._centres = near.centre(transport.correspondence, transport.projector)
        quality = transport.quality
        self._unknown = (
            np.zeros(transport.camera.pixels, dtype=bool)
            if quality is None
            else quality.saturated.ravel()
        )

    def picture(
        self,
        light: Floats,
        *,
        direct: float = 1.0,
        near: float = 1.0,
        far: float = 1.0,
        free: float = 1.0,
    ) -> Floats:
        """Return the standard deviation of a relit picture.

        Where its errors have heavy tails, as under light of a few projector pixels on rows of few
        bright entries, it is half the width of the interval that holds 68 % of them.

        Parameters
        ----------
        light : ndarray, shape (Py, Px) or (Py, Px, channels)
        direct, near, far, free : float
            Gains, as `Transport.relight` takes them.

        Returns
        -------
        ndarray, shape (Cy, Cx) or (Cy, Cx, channels), float32
            Photo units; infinite at saturated camera pixels.

        Raises
        ------
        InputError
            As `Transport.relight`.
        """
        gains = gains_on(self._transport.parts, direct, near, far, free)

        def squares_under(lights: Floats) -> Callable[[slice], Floats]:
            variances = self._variances.of_pictures(lights, gains)
            changes = [self._variances.change_by_place(flat, gains) for flat in lights]

            def of_batch(batch: slice) -> Floats:
                before = variances(batch)
                change = np.stack([of_light(batch) for of_light in changes], axis=1)
                return np.asarray(np.maximum(before + change, LEAST_LEFT * before))

            return of_batch

        (squares,) = self._squares([light], squares_under)
        return self._transport.picture(np.sqrt(squares))

    def mean_squares(self, light: Floats) -> Floats:
        """Return the mean square of the errors of a relit picture that the prior expects.

        It is for means over many camera pixels: it expects as much of all entries of a row, and
        takes less time than `picture`.

        Parameters
        ----------
        light : ndarray, shape (Py, Px) or (Py, Px, channels)

        Returns
        -------
        ndarray, shape (Cy, Cx) or (Cy, Cx, channels), float32
            Squares of photo units; infinite at saturated camera pixels.

        Raises
        ------
        InputError
            As `Transport.relight`.
        """
        (found,) = self.mean_squares_under([light])
        return found

    def mean_squares_under(self, lights: Sequence[Floats]) -> list[Floats]:
        """Return `mean_squares` under each of several lights.

        It takes less time than one light after the other: most of what is computed is the same.

        Parameters
        ----------
        lights : sequence of ndarray, shape (Py, Px) or (Py, Px, channels)

        Returns
        -------
        list of ndarray, shape (Cy, Cx) or (Cy, Cx, channels), float32

        Raises
        ------
        InputError
            As `Transport.relight`.
        """
        transport = self._transport
        gains = gains_on(transport.parts, 1.0, 1.0, 1.0, 1.0)
        values = max(transport.camera.pixels * transport.channels, transport.projector.pixels)
        together = max(1, min(LIGHTS_TOGETHER, VALUES_TOGETHER // values))
        found: list[Floats] = []
        for some in blocks(len(lights), together):
            found += self._squares(
                lights[some], lambda flat: self._variances.of_pictures(flat, gains)
            )
        return [transport.picture(squares) for squares in found]

    def _squares(
        self,
        lights: Sequence[Floats],
        squares_under: Callable[[Floats], Callable[[slice], Floats]],
    ) -> list[Floats]:
        """Return squares of error bars of all camera pixels, (C, channels), under each light.

        Parameters
        ----------
        lights : sequence of ndarray
        squares_under : callable
            Returns, for lights (h, P), a function of camera pixels: squares (n, h, channels).
        """
        transport = self._transport
        # A light of several channels is one light for each.
        flat = [transport.lights(light) for light in lights]
        each = np.concatenate(flat)
        of_batch = squares_under(each)
        shape = (transport.camera.pixels, len(each), transport.channels)
        found = np.empty(shape, dtype=np.float32)

        def work(batch: slice) -> None:
            found[batch] = self._widening**2 * of_batch(batch)

        # Larger batches share more of what is solved for, and take more memory.
        batch = min(BATCH_PIXELS, 2 * BATCH_PIXELS // len(each))
        side_by_side(work, blocks(len(found), max(1, batch)))
        found[self._unknown] = np.inf
        by_light = np.split(found, np.cumsum([len(its) for its in flat])[:-1], axis=1)
        return [
            its[:, 0] if its.shape[1] == 1 else np.einsum("ncc->nc", its).copy() for its in by_light
        ]

    def direct(self) -> Floats:
        """Return the standard deviation of d, (Cy, Cx, channels); 0 without direct light.

        Infinite at saturated camera pixels.
        """
        transport = self._transport
        found = np.empty((transport.camera.pixels, transport.channels), dtype=np.float32)

        def work(batch: slice) -> None:
            found[batch] = self._widening * np.sqrt(self._variances.of_direct(batch))

        side_by_side(work, blocks(len(found), BATCH_PIXELS))
        found *= transport.lit.reshape(-1, 1)
        found[self._unknown] = np.inf
        return found.reshape(*transport.camera, transport.channels)

    def component_rows(self, pixels: slice) -> Components:
        """Return standard deviations of dense rows of D, N and F; see `Transport.component_rows`.

        N and F are the model's: n in the window, f at the frequencies of the far band that the
        transport holds. Free rows take the place of F. Infinite at saturated camera pixels. Some
        milliseconds for each thousand projector pixels and camera pixel.
        """
        selected = range(*pixels.indices(self._transport.camera.pixels))
        shape = (0, self._transport.channels, self._transport.projector.pixels)
        rows = [self._on(c, slice(0, self._transport.projector.height)) for c in selected]
        if not rows:
            return Components(*(np.zeros(shape, dtype=np.float32) for _ in Components._fields))
        return Components(*(np.stack(part) for part in zip(*rows, strict=True)))

    def along(self, pixel: int, line: int) -> Components:
        """Return standard deviations of one camera pixel along one row of the projector.

        Parameters
        ----------
        pixel : int
            Of the camera, row by row.
        line : int
            Row of the projector.

        Returns
        -------
        Components
            Each (channels, Px); as `component_rows`.

        Raises
        ------
        InputError
            If there is no such pixel, or no such row.
        """
        camera, projector = self._transport.camera, self._transport.projector
        if not 0 <= pixel < camera.pixels:
            raise InputError(
                f"the camera of {camera} has no pixel {pixel}: choose one that it has."
            )
        if not 0 <= line < projector.height:
            raise InputError(
                f"the projector of {projector} has no row {line}: choose one that it has."
            )
        return self._on(pixel, slice(line, line + 1))

    def _on(self, c: int, lines: slice) -> Components:
        """Return those of one camera pixel on some projector rows, each (channels, lines * Px)."""
        transport = self._transport
        width = transport.projector.width
        first, last = lines.start * width, lines.stop * width
        d = np.zeros((transport.channels, last - first), dtype=np.float32)
        if self._unknown[c]:
            return Components(*(np.full_like(d, np.inf) for _ in Components._fields))
        n, f = np.zeros_like(d), np.empty_like(d)
        if transport.lit.ravel()[c]:
            deviation = np.sqrt(self._variances.of_direct(slice(c, c + 1)))[0]
            corners, weights = self._direct_pixels(c)
            here = (corners >= first) & (corners < last)
            np.add.at(d.T, corners[here] - first, weights[here, None] * deviation)
            pixels, values = self._window_pixels(c, first, last)
            n[:, pixels - first] = np.sqrt(self._variances.of_window(c, values)).T
        self._add_second(c, first, d)
        for some in blocks(lines.stop - lines.start, max(1, ENTRIES_AT_ONCE // width)):
            on_grid = slice(lines.start + some.start, lines.start + some.stop)
            variance = self._variances.of_far(c, on_grid)
            f[:, some.start * width : some.stop * width] = np.sqrt(variance).T
        return Components(*(np.float32(self._widening) * part for part in (d, n, f)))

    def _add_second(self, c: int, first: int, d: Floats) -> None:
        """Add one camera pixel's standard deviations of direct light from a second place to d."""
        transport = self._transport
        if transport.second_place is None or not isinstance(self._variances, JointVariances):
            return
        place = transport.second_place.reshape(-1, 2)[c]
        if np.isfinite(place).all():
            deviation = np.sqrt(self._variances.of_second(slice(c, c + 1)))[0]
            (corners,), (weights,) = footprint(place[None], transport.projector)
            here = (corners >= first) & (corners < first + d.shape[1])
            np.add.at(d.T, corners[here] - first, weights[here, None] * deviation)

    def _direct_pixels(self, c: int) -> tuple[Integers, Floats]:
        """Return the projector pixels of one camera pixel's footprint, and their shares."""
        transport, one = self._transport, slice(c, c + 1)
        if transport.pitch == 1:
            return self._where.pixels[c], self._where.weights[c]
        q = transport.correspondence.reshape(-1, 2)[one]
        (rows, columns), shares = box_axes(q, transport.boxes[one], transport.projector).shares(0)
        y, x = np.nonzero(shares > SHARE_FLOOR)
        pixels = (rows.start + y) * transport.projector.width + columns.start + x
        return pixels, shares[y, x].astype(np.float32)

    def _window_pixels(self, c: int, first: int, last: int) -> tuple[Integers, Floats]:
        """Return the projector pixels of a camera pixel's window from `first` to before `last`.

        And the value of each function on each of them, (n, J).
        """
        transport, projector = self._transport, self._transport.projector
        centre = self._centres[c : c + 1]
        if transport.pitch == 1:
            inside = near.inside(centre, transport.window, projector)[0]
            pixels = near.window_pixels(centre, transport.window, projector)[0]
            entries = np.flatnonzero(inside & (pixels >= first) & (pixels < last))
            return pixels[entries], np.eye(transport.window**2, dtype=np.float32)[entries]
        reach = transport.near_basis.reach
        sides = [
            np.arange(max(at - reach, 0), min(at + reach + 1, side))
            for at, side in zip(centre[0].tolist(), projector, strict=True)
        ]
        rows = sides[0]
        rows = rows[(rows >= first // projector.width) & (rows < -(-last // projector.width))]
        y, x = (axis.ravel() for axis in np.meshgrid(rows, sides[1], indexing="ij"))
        values = transport.near_basis.values_at(np.stack([y, x], axis=1) - centre)
        return y * projector.width + x, values.astype(np.float32)
