"""What the page shows of one camera pixel.

Index convention: rows are over projector pixels [y, x]. Channels are averaged.
"""

from typing import Any, NamedTuple

import numpy as np

from nearfar.arrays import Floats, Size
from nearfar.estimate.joint import ErrorBars
from nearfar.illumination.frequencies import grid
from nearfar.transport import near
from nearfar.transport.model import Transport
from nearfar.transport.posterior import deviation_of_mean

# Below this share of its largest value a row's spectrum is not told apart from nothing.
LEAST = 1e-7


class Row(NamedTuple):
    """What one camera pixel answers.

    Attributes
    ----------
    words : dict
        q, k_far, k_near and so on, for JSON.
    window, far : ndarray, shape (Py, Px), float32
        D + N, and F.
    window_error, far_error : ndarray, shape (Px,), float32
        Standard deviations along the projector's row of q, which `words` names, for errors of
        channels that are independent; 0 where the transport does not tell.
    spectrum : ndarray, shape (Py, Px), float32
        |t^| over its largest value in dB, DC in the middle.
    """

    words: dict[str, Any]
    window: Floats
    far: Floats
    window_error: Floats
    far_error: Floats
    spectrum: Floats


def inspect_row(transport: Transport, x: int) -> Row:
    """Tell what a camera pixel answers to each projector pixel.

    Parameters
    ----------
    transport : Transport
        Of one row of the camera.
    x : int
        Column of the camera.
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
    words: dict[str, Any] = {
        "q": [float(side) for side in q] if np.isfinite(q).all() else None,
        "line": line,
        "window": transport.window,
        "no_errors": "the joint estimate tells them" if transport.posterior is None else "",
        "confidence": None if quality is None else float(quality.confidence[0, x]),
        "saturated": None if quality is None else bool(quality.saturated[0, x]),
        "floodlit": {"direct": float(d.sum()), "near": float(n.sum()), "far": float(f.sum())},
        **_bands(transport),
    }
    return Row(words, window, far, errors[0], errors[1], _spectrum(window + far))


def _spectrum(row: Floats) -> Floats:
    size = np.abs(np.fft.fftshift(np.fft.fft2(row)))
    most = max(float(size.max()), float(np.finfo(np.float32).tiny))
    return np.asarray(20 * np.log10(np.maximum(size / most, LEAST)), dtype=np.float32)


def _bands(transport: Transport) -> dict[str, Any]:
    """Tell where far- and near-range light was measured, in cycles per projector pixel."""
    far = np.abs(transport.far_basis.cycles).max(axis=0, initial=0.0)
    if transport.posterior is not None:
        measured = [(float(k.fy), float(k.fx)) for k in transport.posterior.frequencies]
    else:
        side = Size(transport.window, transport.window)
        measured = [(float(k.fy), float(k.fx)) for k in grid(side, side)]
    beyond = [k for k in measured if abs(k[0]) > far[0] or abs(k[1]) > far[1]]
    # The checkerboard is there for direct light; along a side of one pixel there is no frequency.
    of_near = [k for k in beyond if min(map(abs, k)) < 0.5] or [(float(far[0]), float(far[1]))]
    there = np.array(transport.projector) > 1
    return {
        "k_far": far.tolist(),
        "k_near": (np.abs(of_near).max(axis=0) * there).tolist(),
        "measured": [list(k) for k in measured],
    }
