"""The row of the transport of one camera pixel, as the page plots it.

Index convention: rows are over projector pixels [y, x]. Channels are averaged.
"""

from typing import Any, NamedTuple

import numpy as np

from nearfar.arrays import Floats, Size
from nearfar.estimate.error_bars import ErrorBars
from nearfar.illumination.frequencies import grid
from nearfar.transport import near
from nearfar.transport.band import band_edge
from nearfar.transport.components import Components
from nearfar.transport.model import Transport
from nearfar.transport.posterior import Posterior, deviation_of_mean

# Spectra end at this fraction of their largest value (-140 dB).
RELATIVE_SPECTRUM_FLOOR = 1e-7


class TransportRow(NamedTuple):
    """The row of one camera pixel.

    Attributes
    ----------
    header : dict
        Scalars for JSON: q, confidence, k_far, k_near and so on.
    window, far : ndarray, shape (Py, Px), float32
        D + N, and F.
    window_error, far_error : ndarray, shape (Px,), float32
        Standard deviations along the projector row of q (``line`` in the header), for errors that
        are independent between channels; 0 if the transport has no posterior, infinite if the
        camera pixel is saturated.
    spectrum : ndarray, shape (Py, Px), float32
        Magnitude of the row's Fourier transform in dB, 0 for the largest, DC in the middle.
    """

    header: dict[str, Any]
    window: Floats
    far: Floats
    window_error: Floats
    far_error: Floats
    spectrum: Floats


def transport_row(transport: Transport, x: int) -> TransportRow:
    """Return the row of one camera pixel, with its error bars and spectrum.

    Parameters
    ----------
    transport : Transport
        Its camera has one row of pixels.
    x : int
        Camera column.
    """
    pixel, projector = slice(x, x + 1), transport.projector
    d, n, f = (part[0].mean(axis=0) for part in transport.component_rows(pixel))
    window, far = (part.reshape(projector) for part in (d + n, f))
    q = transport.correspondence[0, x]
    line = near.line_through(q, projector)
    errors = np.zeros((2, projector.width), dtype=np.float32)
    if transport.posterior is not None:
        d_error, n_error, f_error = ErrorBars(transport).along(x, line)
        errors[0] = deviation_of_mean(np.hypot(d_error, n_error))
        errors[1] = deviation_of_mean(f_error)
    quality = transport.quality
    saturated = None if quality is None else bool(quality.saturated[0, x])
    header: dict[str, Any] = {
        "q": [float(side) for side in q] if np.isfinite(q).all() else None,
        "line": line,
        # In projector pixels.
        "window": transport.window * transport.pitch,
        "no_errors": _why_no_errors(transport, saturated=saturated),
        "confidence": None
        if quality is None or "near" not in transport.parts
        else float(quality.confidence[0, x]),
        "saturated": saturated,
        "floodlit": {
            part: float(row.sum()) for part, row in transport.named(Components(d, n, f)).items()
        },
        **bands_of(transport),
    }
    spectrum = in_decibels(magnitude_of(window + far))
    return TransportRow(header, window, far, errors[0], errors[1], spectrum)


def _why_no_errors(transport: Transport, *, saturated: bool | None) -> str:
    if transport.posterior is None:
        return "this estimate does not tell them"
    return "they are unknown" if saturated else ""


def magnitude_of(row: Floats) -> Floats:
    """Return the magnitude of a row's Fourier transform, (Py, Px), DC in the middle."""
    return np.abs(np.fft.fftshift(np.fft.fft2(row)))


def in_decibels(magnitude: Floats) -> Floats:
    """Return magnitudes in dB, 0 for the largest."""
    largest = max(float(magnitude.max()), float(np.finfo(np.float32).tiny))
    relative = np.maximum(magnitude / largest, RELATIVE_SPECTRUM_FLOOR)
    return np.asarray(20 * np.log10(relative), dtype=np.float32)


def bands_of(transport: Transport) -> dict[str, Any]:
    """Return k_far, k_near and the measured frequencies, in cycles per projector pixel."""
    far = band_edge(transport)
    posterior = transport.posterior
    if posterior is not None and "free" not in transport.parts:
        # Other people's patterns measure no frequency by itself: those that the transport holds.
        held = posterior if isinstance(posterior, Posterior) else transport.far_basis
        measured = [(float(k.fy), float(k.fx)) for k in held.frequencies]
    else:
        side = Size(transport.window, transport.window)
        measured = [(float(k.fy), float(k.fx)) for k in grid(side, side)]
    beyond = [k for k in measured if abs(k[0]) > far[0] or abs(k[1]) > far[1]]
    # Without the checkerboard, which measures direct light.
    of_near = [k for k in beyond if min(map(abs, k)) < 0.5] or [(float(far[0]), float(far[1]))]
    # Along a side of one pixel there is no frequency but 0.
    has_frequencies = np.array(transport.projector) > 1
    return {
        "k_far": far.tolist(),
        "k_near": (np.abs(of_near).max(axis=0) * has_frequencies).tolist(),
        "measured": [list(k) for k in measured],
    }
