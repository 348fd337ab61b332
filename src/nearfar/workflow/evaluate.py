"""How good a transport is: SNR_b of relighting, SNR_t of rows, and the components (section 5.1).

Index convention: rows are (n, channels, P), n camera pixels in a block.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import fft

from nearfar.arrays import Floats, blocks, middles, processors
from nearfar.callbacks import OldReport, Report, as_report
from nearfar.checks import as_number, finite_numbers
from nearfar.errors import InputError
from nearfar.estimate.fit import fit_model
from nearfar.illumination.pictures import standard_lights
from nearfar.transport.exact import ExactTransport
from nearfar.transport.known import KnownTransport
from nearfar.transport.model import Transport
from nearfar.transport.parts import USUAL_PARTS
from nearfar.workflow.units import nearest_factor

BLOCK = 128
# Rows along each side of the camera that are compared with an operator's: all would be C x P.
ROWS_ALONG = 11
WORKERS = processors()
# An exact match has no finite SNR; JSON needs a number.
HIGHEST = 300.0
# A row whose energy is below this share of the strongest row's holds no light that a camera sees:
# a millionth of its amplitude.
SMALLEST_ENERGY_SHARE = 1e-12
PERCENTILES = (0, 5, 25, 50, 75, 95, 100)


def snr(truth: Floats, estimate: Floats) -> float:
    """Return the signal-to-noise ratio ``20 log10 |truth| / |truth - estimate|`` (section 5.1).

    Parameters
    ----------
    truth, estimate : array_like
        Of one shape.

    Returns
    -------
    float
        In dB, between -HIGHEST and HIGHEST.

    Raises
    ------
    InputError
        If the shapes differ, or the arrays do not hold finite numbers.

    Examples
    --------
    >>> round(nearfar.snr([1.0, 1.0], [1.1, 0.9]), 1)
    20.0
    """
    truth, estimate = finite_numbers(truth, "the truth"), finite_numbers(estimate, "the estimate")
    if truth.shape != estimate.shape:
        raise InputError(
            f"the truth has shape {truth.shape} and the estimate {estimate.shape}: compare arrays "
            f"of one shape."
        )
    signal = float(np.linalg.norm(truth.astype(np.float64).ravel()))
    error = float(np.linalg.norm((truth.astype(np.float64) - estimate).ravel()))
    return decibels(signal**2, error**2)


def decibels(signal: float, error: float) -> float:
    """Turn energies of the truth and of the error into dB, between -HIGHEST and HIGHEST."""
    if signal <= 0.0:
        return -HIGHEST if error > 0.0 else HIGHEST
    return float(np.clip(10 * np.log10(signal / max(error, 1e-300)), -HIGHEST, HIGHEST))


@dataclass(frozen=True, eq=False)
class Rows:
    """How rows and frequencies fare.

    Attributes
    ----------
    snr_t : ndarray, shape (Cy, Cx)
        SNR_t of each camera pixel, channels together, dB; NaN where the truth holds no light, and
        at pixels that were not compared.
    snr_b_of_frequency : ndarray, shape (Py, Px)
        SNR_b under exp(-j 2 pi k.p) for every DFT frequency k, DC in the middle, dB.
    components : mapping
        SNR of ``T``, and of ``D``, ``N`` and ``F`` where they are known, dB.
    compared : int
        Camera pixels that were compared: all, or a sample where the truth is an operator.
    """

    snr_t: Floats
    snr_b_of_frequency: Floats
    components: Mapping[str, float]
    compared: int

    @property
    def without_light(self) -> int:
        """Number of camera pixels that were compared and that the truth leaves dark."""
        return self.compared - int(np.isfinite(self.snr_t).sum())


def require_same_kind(transport: Transport, truth: KnownTransport) -> None:
    """Refuse a truth of another size.

    Raises
    ------
    InputError
    """
    ours = (transport.projector, transport.camera, transport.channels)
    theirs = (truth.projector, truth.camera, truth.channels)
    if ours != theirs:
        raise InputError(
            f"the transport is of a projector {ours[0]}, a camera {ours[1]} and {ours[2]} "
            f"channels, the truth of {theirs[0]}, {theirs[1]} and {theirs[2]}: compare two of the "
            f"same scene and sizes."
        )


class Exposure(NamedTuple):
    """Photo units per unit of the truth.

    Attributes
    ----------
    factor : float
    is_fitted : bool
        Whether it was fitted, as the rig did not record it.
    """

    factor: float
    is_fitted: bool


def exposure_of(transport: Transport, truth: KnownTransport) -> Exposure:
    """Return the exposure that the capture's rig recorded, or that fits best where it did not.

    Only a simulated rig knows it: a real camera has units of its own, and so has a truth that was
    measured. A transport that was made without photos is in the truth's units.
    """
    rig = transport.provenance.get("rig")
    if not isinstance(rig, Mapping):
        return Exposure(1.0, is_fitted=False)
    recorded = rig.get("transport_exposure")
    if recorded is None:
        return Exposure(fitted_exposure(transport, truth), is_fitted=True)
    return Exposure(float(recorded), is_fitted=False)


def fitted_exposure(transport: Transport, truth: KnownTransport) -> float:
    """Return the factor that brings the truth nearest to the transport, by least squares.

    Both are compared by pictures under white, under a random light and under natural pictures.

    Raises
    ------
    InputError
        If the sizes of the two differ.
    """
    require_same_kind(transport, truth)
    lights = np.stack(list(standard_lights(transport.projector).values()))
    known, found = (each.pictures(lights).astype(np.float64) for each in (truth, transport))
    return nearest_factor(known, found)


def relighting_snr(
    transport: Transport,
    truth: KnownTransport,
    lights: Mapping[str, Floats],
    *,
    exposure: float | None = None,
) -> dict[str, float]:
    """Return SNR_b under each light: how well relit pictures agree with the truth (section 5.1).

    Parameters
    ----------
    transport : Transport
    truth : ExactTransport or ExactOperator
    lights : mapping of str to ndarray
        Lights by name, (Py, Px) or (Py, Px, channels).
    exposure : float, optional
        Photo units per unit of the truth. By default what the capture's rig recorded, or what fits
        best where it is a real rig, which knows none.

    Returns
    -------
    dict of str to float
        In dB.

    Raises
    ------
    InputError
        If the sizes of the two transports differ, or a light does not fit them.

    Examples
    --------
    >>> found = nearfar.relighting_snr(transport, truth, {"white": nearfar.white(size)})
    >>> bool(found["white"] > 30)
    True
    """
    require_same_kind(transport, truth)
    factor = _factor(exposure, transport, truth)
    found = {}
    for name, light in lights.items():
        picture = factor * (truth @ light)
        found[name] = snr(picture, (transport @ light).reshape(picture.shape))
    return found


def _factor(exposure: float | None, transport: Transport, truth: KnownTransport) -> np.float32:
    """Return the exposure as a float32: as given, recorded, or fitted."""
    if exposure is None:
        return np.float32(exposure_of(transport, truth).factor)
    return np.float32(as_number(exposure, "the exposure"))


def row_snr(
    transport: Transport,
    truth: KnownTransport,
    *,
    exposure: float | None = None,
    progress: Report | OldReport | None = None,
) -> Rows:
    """Compare every row of T with the truth, or a sample where the truth is an operator.

    Parameters
    ----------
    transport : Transport
    truth : ExactTransport or ExactOperator
        Where its components are apart, D, N and F are compared as the scene's physics has them.
    exposure : float, optional
        As of `relighting_snr`.
    progress : callable, optional
        Called with what is being done and the share of it that is done, 0 to 1.

    Raises
    ------
    InputError
        If sizes differ.

    Examples
    --------
    >>> rows = nearfar.row_snr(transport, truth)
    >>> rows.snr_t.shape  # SNR_t of each camera pixel, in dB
    (8, 8)
    >>> list(rows.components)
    ['T']
    """
    report = as_report(progress)
    require_same_kind(transport, truth)
    factor = _factor(exposure, transport, truth)
    pixels, projector = transport.camera.pixels, transport.projector
    signal, error = np.zeros(pixels), np.zeros(pixels)
    signal_k, error_k = np.zeros(projector), np.zeros(projector)
    parts = dict.fromkeys("DNF" if can_compare_parts(transport, truth) else "", (0.0, 0.0))
    compared = _rows_to_compare(truth)
    for block in compared:
        known = truth.component_rows(block) if truth.is_apart else (truth.rows(block),)
        found = transport.component_rows(block)
        rows = _sum(known)
        rows *= factor
        off = rows - _sum(found)
        signal[block], error[block] = _energy_of_rows(rows), _energy_of_rows(off)
        signal_k += _energy_of_frequencies(rows.reshape(-1, *projector))
        error_k += _energy_of_frequencies(off.reshape(-1, *projector))
        # Without known components there is nothing to compare apart.
        for name, values, mine in zip(parts, known, found, strict=False):
            one, other = energies(factor * values, mine)
            parts[name] = (parts[name][0] + one, parts[name][1] + other)
        report("rows", block.stop / pixels)
    components = {"T": decibels(float(signal.sum()), float(error.sum()))}
    components |= {name: decibels(*pair) for name, pair in parts.items()}
    return Rows(
        snr_where_lit(signal, error).reshape(transport.camera),
        np.fft.fftshift(snr_where_lit(signal_k, error_k)),
        components,
        sum(block.stop - block.start for block in compared),
    )


def can_compare_parts(transport: Transport, truth: KnownTransport) -> bool:
    """Return whether both are split into direct, near- and far-range light."""
    return truth.is_apart and transport.parts == USUAL_PARTS


def _rows_to_compare(truth: KnownTransport) -> list[slice]:
    """Return the blocks of camera pixels whose rows are compared."""
    if isinstance(truth, ExactTransport):
        return list(blocks(truth.camera.pixels, BLOCK))
    along = (middles(side, -(-side // ROWS_ALONG)) for side in truth.camera)
    chosen = np.add.outer(next(along) * truth.camera.width, next(along))
    return [slice(pixel, pixel + 1) for pixel in chosen.ravel().tolist()]


def snr_where_lit(signal: Floats, error: Floats) -> Floats:
    """Turn energies into dB, between -HIGHEST and HIGHEST; NaN where the truth holds no light.

    Next to no light has no SNR worth a mean: the least error would count as hundreds of dB.
    """
    lit = signal > SMALLEST_ENERGY_SHARE * signal.max(initial=0.0)
    found = np.full(signal.shape, np.nan)
    found[lit] = 10 * np.log10(signal[lit] / np.maximum(error[lit], 1e-300))
    return np.asarray(np.clip(found, -HIGHEST, HIGHEST))


def snr_of_rows(truth: ExactTransport, found: ExactTransport) -> Floats:
    """SNR_t of each camera pixel of a transport without a model, as of `Rows`, (C,)."""
    signal, error = np.empty(truth.camera.pixels), np.empty(truth.camera.pixels)
    for block in blocks(truth.camera.pixels, BLOCK):
        rows = truth.rows(block)
        signal[block], error[block] = (
            _energy_of_rows(rows),
            _energy_of_rows(rows - found.rows(block)),
        )
    return snr_where_lit(signal, error)


def energies(truth: Floats, estimate: Floats) -> tuple[float, float]:
    """Return the energy of the truth and of the error."""
    error = truth - estimate
    return float(_energy_of_rows(truth).sum()), float(_energy_of_rows(error).sum())


def _sum(parts: Sequence[Floats]) -> Floats:
    """Add arrays into a new one."""
    total = parts[0] + parts[1] if len(parts) > 1 else parts[0].copy()
    for part in parts[2:]:
        total += part
    return total


def _energy_of_rows(rows: Floats) -> NDArray[np.float64]:
    """Sum squares over each row's channels and projector pixels, (n,)."""
    flat = rows.reshape(len(rows), 1, -1)
    return (flat @ flat.transpose(0, 2, 1)).astype(np.float64)[:, 0, 0]


def _energy_of_frequencies(rows: Floats) -> Floats:
    """Sum |DFT|^2 over rows (n, Py, Px): (Py, Px)."""
    spectrum = fft.rfft2(rows, workers=WORKERS)
    half = np.einsum("nyx,nyx->yx", spectrum.real, spectrum.real, dtype=np.float64)
    half += np.einsum("nyx,nyx->yx", spectrum.imag, spectrum.imag, dtype=np.float64)
    # Rows are real: k and -k have the same energy.
    width = rows.shape[2]
    rest = np.arange(half.shape[1], width)
    mirrored = half[-np.arange(half.shape[0])][:, width - rest]
    return np.concatenate([half, mirrored], axis=1)


def model_truth(
    transport: Transport, truth: ExactTransport, exposure: float | None = None
) -> Transport:
    """Fit the transport's own W and far band to the truth, in the transport's photo units."""
    require_same_kind(transport, truth)
    fitted = fit_model(truth, transport.window, transport.far_basis)
    gain = float(_factor(exposure, transport, truth))
    return fitted.with_gains(direct=gain, near=gain, far=gain)


def split_snr(transport: Transport, model: Transport) -> dict[str, float]:
    """SNR of D, N and F against the model's truth, dB: see `model_truth`."""
    totals = dict.fromkeys("DNF", (0.0, 0.0))
    for block in blocks(transport.camera.pixels, BLOCK):
        pairs = zip(
            totals, model.component_rows(block), transport.component_rows(block), strict=True
        )
        for name, values, mine in pairs:
            one, other = energies(values, mine)
            totals[name] = (totals[name][0] + one, totals[name][1] + other)
    return {name: decibels(*pair) for name, pair in totals.items()}


def floodlit_snr(
    transport: Transport, truth: KnownTransport, exposure: float | None = None
) -> dict[str, float]:
    """SNR of the direct, near and far pictures under full white, as physics has them, dB."""
    light = np.ones(transport.projector, dtype=np.float32)
    factor = _factor(exposure, transport, truth)
    pairs = zip("DNF", truth.component_pictures(light), transport.components(light), strict=True)
    return {name: snr(factor * values, mine.reshape(values.shape)) for name, values, mine in pairs}


def percentiles(values: Floats) -> dict[str, float]:
    """Mean and percentiles of the values that are known, ready for JSON; 0 if there are none."""
    known = values[np.isfinite(values)]
    if not known.size:
        known = np.zeros(1)
    found = {f"p{p}": float(np.percentile(known, p)) for p in PERCENTILES}
    return {"mean": float(np.mean(known)), **found}
