"""Where the paper's assumptions hold on a scene (sections 3.2, 3.3 and 4.2).

The method takes N to lie in a window and to be silent beyond k_near, F to be silent beyond k_far,
and both to be silent at the checkerboard. `check_model` says how much of each lies elsewhere, and
how well the best D + N + F of the model would relight.

Index convention: rows are (n, channels, Py, Px), n camera pixels in a block.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from math import gcd

import numpy as np
from numpy.typing import NDArray
from scipy import fft

from nearfar.arrays import AnySize, Floats, Size, as_size, blocks, product
from nearfar.callbacks import OldReport, Report, as_report
from nearfar.checks import as_count, as_number
from nearfar.errors import InputError
from nearfar.illumination.frequencies import band, default_dropped
from nearfar.illumination.pictures import standard_lights
from nearfar.parallel import threads
from nearfar.plan import paper_plan
from nearfar.plan.window import largest_window
from nearfar.transport import near
from nearfar.transport.apart import Apart
from nearfar.transport.exact import ExactTransport
from nearfar.transport.known import KnownTransport
from nearfar.transport.model import Transport
from nearfar.workflow.evaluate import decibels, snr_where_lit
from nearfar.workflow.model_fit import far_basis_of, held_by_model, split_by_model

# Camera pixels of a block, and the values of its rows.
PIXELS_AT_ONCE = 64
VALUES_AT_ONCE = 2**22
# Camera pixels that are examined by default, evenly spaced, and entries of their rows in all, per
# channel; fewer pixels would not stand for the scene.
DEFAULT_SAMPLE = 4096
DEFAULT_ENTRIES = 2**27
LEAST_SAMPLE = 64
# Shares of the energy whose bandwidths are reported.
ENERGY_SHARES = (0.5, 0.9, 0.99)


@dataclass(frozen=True, eq=False)
class ModelCheck:
    """Where a transport keeps to the paper's model; shares are of energy, 0 to 1.

    Attributes
    ----------
    window : int
        W.
    far : Size
        Far band, in DFT frequencies of the pattern grid.
    k_near : float
        Cycles per projector pixel, on either axis.
    camera_pixels : int
        Camera pixels that were examined.
    floodlit : mapping
        Shares of direct, near and far in the light under full white.
    near_beyond, near_outside : float
        Shares of N beyond k_near, and outside the window.
    near_bandwidth, far_bandwidth : mapping
        Cycles per projector pixel, on either axis, that hold a share of the energy.
    far_beyond : float
        Share of F beyond k_far.
    far_beyond_in_window : float
        Share of that part that lies inside the window, where n takes it up.
    checkerboard_near, checkerboard_far : float
        Amplitude of N's and of F's response to the checkerboard over D's, root mean square over lit
        camera pixels: what the direct estimate is off by.
    far_beyond_map, checkerboard_map : ndarray, shape (n,)
        Per camera pixel examined: share of F beyond k_far that is outside the window, and
        |N + F| over D at the checkerboard (NaN without direct light).
    best_pictures, best_rows : float
        The most that the model with this W and far band can reach, without noise, in dB: SNR_b
        under natural pictures, their mean, and SNR_t of the median camera pixel that sees light.
    lit : float
        Share of direct light's camera pixels among those that see any light.
    is_split_by_model : bool
        Whether the components were not known apart, and are those of `nearfar.workflow.model_fit`.
    """

    window: int
    far: Size
    k_near: float
    camera_pixels: int
    floodlit: Mapping[str, float]
    near_beyond: float
    near_outside: float
    near_bandwidth: Mapping[float, float]
    far_beyond: float
    far_beyond_in_window: float
    far_bandwidth: Mapping[float, float]
    checkerboard_near: float
    checkerboard_far: float
    far_beyond_map: Floats
    checkerboard_map: Floats
    best_pictures: float
    best_rows: float
    lit: float
    is_split_by_model: bool


def default_k_near(window: int) -> float:
    """Return 3 / W cycles per pixel, at most 1/2.

    The window's light falls off towards its border, so it varies over a third of W or more. The
    paper gives no number; it finds 2 k_near > W in cycles across the projector (section 3.3).
    """
    return min(0.5, 3.0 / window)


def default_sample(projector: Size) -> int:
    """Return how many camera pixels are examined by default: fewer where rows are long."""
    affordable = DEFAULT_ENTRIES // projector.pixels
    return min(DEFAULT_SAMPLE, max(LEAST_SAMPLE, affordable))


def check_model(
    transport: KnownTransport | Transport,
    window: int,
    far: AnySize,
    *,
    k_near: float | None = None,
    sample: int | None = None,
    progress: Report | OldReport | None = None,
) -> ModelCheck:
    """Measure how far a transport departs from the paper's model.

    Parameters
    ----------
    transport : ExactTransport, ExactOperator or Transport
        If its components are not known apart, they are split as the model fits them best.
    window : int
        W.
    far : Size or (height, width)
        Far band.
    k_near : float, optional
        Cycles per projector pixel; `default_k_near` if left out.
    sample : int, optional
        Camera pixels to examine, evenly spaced; all where there are fewer. 4096 if left out, fewer
        where the projector has more than 181 x 181 pixels, but 64 at least.
    progress : callable, optional
        Called with what is being done and the share of it that is done, 0 to 1.

    Returns
    -------
    ModelCheck

    Raises
    ------
    InputError
        If W or the far band do not fit the projector, or the transport holds no light.

    Examples
    --------
    >>> found = nearfar.check_model(transport, window=3, far=(3, 3))
    >>> sorted(found.floodlit)  # shares of the light under full white
    ['direct', 'far', 'near']
    """
    report = as_report(progress)
    projector, far = transport.projector, as_size(far, "far band")
    window = as_count(window, "window")
    sample = default_sample(projector) if sample is None else sample
    sample = as_count(sample, "the sample of camera pixels")
    if (
        not 1 <= window <= largest_window(projector)
        or far.height > projector[0]
        or far.width > projector[1]
    ):
        raise InputError(
            f"W = {window} and a far band of {far} do not fit a projector of {projector}: choose "
            f"smaller ones."
        )
    limit = default_k_near(window) if k_near is None else as_number(k_near, "k_near")
    if sample < 1 or not limit > 0:
        raise InputError(
            f"a sample of {sample} camera pixels and k_near = {limit} tell nothing: both must be "
            f"above 0."
        )
    apart: Apart = transport
    if isinstance(transport, ExactTransport) and not transport.is_apart:
        apart = split_by_model(transport, window, far)
    totals = _Totals(projector, window, far)
    pixels = transport.camera.pixels
    step = max(1, pixels // sample)
    # Evenly spaced, but not down the same few columns of the camera.
    while step > 1 and gcd(step, transport.camera.width) > 1:
        step += 1
    chosen = np.arange(0, pixels, step)
    q = apart.correspondence.reshape(-1, 2)
    centres = near.centre(q, projector)
    lit = np.isfinite(q[:, 0])
    affordable = VALUES_AT_ONCE // (transport.channels * projector.pixels)
    for block in blocks(len(chosen), min(PIXELS_AT_ONCE, affordable)):
        mine = chosen[block]
        part = slice(int(mine[0]), int(mine[-1]) + 1, step)
        rows = [
            np.asarray(component).reshape(len(mine), -1, *projector)
            for component in apart.component_rows(part)
        ]
        totals.add(rows, centres[mine], lit[mine])
        totals.fit(rows, q[mine])
        report("rows", block.stop / len(chosen))
    return totals.result(limit, lit[chosen], is_split_by_model=apart is not transport)


def dropped_of(projector: Size, window: int, far: Size, dropped: Size | None) -> Size:
    """Return the near frequencies that the paper's plan of this W and far band drops.

    Raises
    ------
    PlanError
        If there is no such plan.
    """
    if min(projector) > 1:
        plan = paper_plan(projector, window, far, dropped=dropped, correspondence="none")
        return plan.dropped
    # No plan fits a projector of one row or column: its windows run all along it.
    return default_dropped(window, far, projector) if dropped is None else dropped


class _Totals:
    """Energies that add up over blocks of camera pixels."""

    def __init__(self, projector: Size, window: int, far: Size) -> None:
        self.projector, self.window, self.far = projector, window, far
        # Rows are real: of k and -k one is looked at, and the energy of k and -k together.
        self.half = projector.width // 2 + 1
        frequencies = [np.abs(np.fft.fftfreq(n)) for n in projector]
        # |k| on either axis, as bands and windows are square.
        self.height = np.maximum(frequencies[0][:, None], frequencies[1][None, : self.half])
        inside = [np.isin(_whole(n), band(m)) for n, m in zip(projector, far, strict=True)]
        in_band = inside[0][:, None] & inside[1][None, :]
        # Bands of even sides hold k without -k.
        opposite = np.roll(in_band[::-1, ::-1], 1, axis=(0, 1))
        beyond = 1.0 - 0.5 * (in_band + opposite.astype(np.float64))
        self.beyond_band = beyond[:, : self.half]
        columns = np.arange(self.half)
        self.of_pair = np.where((columns == 0) | (2 * columns == projector.width), 1.0, 2.0)
        y, x = np.indices(projector)
        self.checkerboard = 1.0 - 2.0 * ((y + x) % 2)
        self.flood = np.zeros(3)
        self.spectrum = np.zeros((2, projector.height, self.half))
        self.near = np.zeros(2)  # outside the window, all
        self.beyond = np.zeros(2)  # beyond k_far: inside the window, all
        self.board = np.zeros(3)  # energies of D, N and F at the checkerboard, lit pixels
        self.far_maps: list[Floats] = []
        self.board_maps: list[Floats] = []
        self.basis = far_basis_of(far, projector)
        pictures = [
            light for name, light in standard_lights(projector).items() if name.startswith("pict")
        ]
        self.pictures = np.stack(pictures).reshape(len(pictures), -1).astype(np.float32)
        self.picture_energies = np.zeros((2, len(pictures)))  # of the truth, of the error
        self.row_energies: list[NDArray[np.float64]] = []

    def add(self, rows: list[Floats], centres: NDArray[np.int64], lit: NDArray[np.bool_]) -> None:
        self.flood += [float(part.sum(dtype=np.float64)) for part in rows]
        _, n, f = rows
        mask = self._windows(centres) & lit[:, None, None]
        self.near += [
            float(np.sum((n * ~mask[:, None]) ** 2, dtype=np.float64)),
            float(np.sum(n**2, dtype=np.float64)),
        ]
        for number, part in enumerate((n, f)):
            spectrum = fft.rfft2(part, workers=threads())
            self.spectrum[number] += (
                self.of_pair * np.einsum("ncyx,ncyx->yx", spectrum, spectrum.conj()).real
            )
            if number == 1:
                spectrum *= self.beyond_band.astype(np.float32)
                high = fft.irfft2(spectrum, s=self.projector, workers=threads())
                within = np.sum(high**2 * mask[:, None], axis=(1, 2, 3), dtype=np.float64)
                total = np.sum(high**2, axis=(1, 2, 3), dtype=np.float64)
                self.beyond += [within.sum(), total.sum()]
                every = np.sum(part**2, axis=(1, 2, 3), dtype=np.float64)
                self.far_maps.append((total - within) / np.maximum(every, 1e-300))
        boards = [np.einsum("ncyx,yx->nc", part, self.checkerboard) for part in rows]
        self.board += [float(np.sum(board[lit] ** 2)) for board in boards]
        other = np.sqrt(np.sum((boards[1] + boards[2]) ** 2, axis=1))
        own = np.sqrt(np.sum(boards[0] ** 2, axis=1))
        self.board_maps.append(np.where(lit, other / np.maximum(own, 1e-300), np.nan))

    def fit(self, rows: list[Floats], q: Floats) -> None:
        """Add what the model can hold at best of these rows."""
        whole = rows[0] + rows[1] + rows[2]
        off = whole - sum(held_by_model(whole, q, self.window, self.basis))
        flat = [part.reshape(-1, self.projector.pixels) for part in (whole, off)]
        self.picture_energies += [
            np.sum(product(part, self.pictures.T).astype(np.float64) ** 2, axis=0) for part in flat
        ]
        squares = [
            np.square(part).reshape(len(whole), -1).sum(axis=1, dtype=np.float64) for part in flat
        ]
        self.row_energies.append(np.stack(squares))

    def _windows(self, centres: NDArray[np.int64]) -> NDArray[np.bool_]:
        mask = np.zeros((len(centres), self.projector.pixels), dtype=bool)
        inside = near.inside(centres, self.window, self.projector)
        places = near.window_pixels(centres, self.window, self.projector)
        number, entry = np.nonzero(inside)
        mask[number, places[number, entry]] = True
        return mask.reshape(-1, *self.projector)

    def result(
        self, k_near: float, lit: NDArray[np.bool_], *, is_split_by_model: bool
    ) -> ModelCheck:
        n, f = self.spectrum
        d_board = max(self.board[0], 1e-300)
        total = max(float(self.flood.sum()), 1e-300)
        best = snr_where_lit(*np.concatenate(self.row_energies, axis=1))
        bright = np.isfinite(best)
        return ModelCheck(
            window=self.window,
            far=self.far,
            k_near=k_near,
            camera_pixels=sum(len(part) for part in self.far_maps),
            floodlit={
                name: float(value / total)
                for name, value in zip(("direct", "near", "far"), self.flood, strict=True)
            },
            near_beyond=_share(n[self.height > k_near].sum(), n.sum()),
            near_outside=_share(*self.near),
            near_bandwidth=self._bandwidth(n),
            far_beyond=_share((f * self.beyond_band).sum(), f.sum()),
            far_beyond_in_window=_share(*self.beyond),
            far_bandwidth=self._bandwidth(f),
            checkerboard_near=float(np.sqrt(self.board[1] / d_board)),
            checkerboard_far=float(np.sqrt(self.board[2] / d_board)),
            far_beyond_map=np.concatenate(self.far_maps),
            checkerboard_map=np.concatenate(self.board_maps),
            best_pictures=float(
                np.mean([decibels(*pair) for pair in self.picture_energies.T.tolist()])
            ),
            best_rows=float(np.median(best[bright])) if bright.any() else 0.0,
            lit=float(lit[bright].mean()) if bright.any() else 0.0,
            is_split_by_model=is_split_by_model,
        )

    def _bandwidth(self, energy: Floats) -> dict[float, float]:
        order = np.argsort(self.height, axis=None, kind="stable")
        rising = np.cumsum(energy.ravel()[order])
        if rising[-1] <= 0:
            return dict.fromkeys(ENERGY_SHARES, 0.0)
        places = np.searchsorted(rising, np.array(ENERGY_SHARES) * rising[-1])
        return {
            share: float(self.height.ravel()[order[place]])
            for share, place in zip(ENERGY_SHARES, places, strict=True)
        }


def _whole(count: int) -> NDArray[np.int64]:
    """Whole frequencies in the order of the DFT."""
    return np.asarray(np.rint(np.fft.fftfreq(count) * count).astype(np.int64))


def _share(part: float, whole: float) -> float:
    return float(part / whole) if whole > 0 else 0.0
