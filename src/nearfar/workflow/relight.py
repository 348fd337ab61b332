"""Relight a transport that is in a file, some rows of the camera at a time."""

from collections.abc import Mapping

import numpy as np

from nearfar.arrays import Floats
from nearfar.estimate.error_bars import ErrorBars
from nearfar.estimate.physical import PhysicalErrorBars, split_physically
from nearfar.transport.analysed import AnalysedLight
from nearfar.transport.parts import require_parts
from nearfar.transport.stored import StoredTransport


def relight_stored(stored: StoredTransport, light: Floats, gains: Mapping[str, float]) -> Floats:
    """Relight the scene, as `nearfar.Transport.relight` does.

    Parameters
    ----------
    stored : StoredTransport
    light : ndarray, shape (Py, Px) or (Py, Px, channels)
        As `nearfar.Transport.relight` takes it.
    gains : mapping of str to float
        Gain of each part, ``"direct"``, ``"near"``, ``"far"`` or ``"free"``; 1 where left out.

    Returns
    -------
    ndarray, shape (Cy, Cx) or (Cy, Cx, channels), float32
        In photo units.

    Raises
    ------
    InputError
        If the transport does not have a part.
    """
    require_parts(stored.parts, gains)
    analysed: AnalysedLight | None = None
    parts = []
    for rows in stored.blocks():
        analysed = analysed or rows.analyse(light)
        parts.append(rows.relight(analysed, **gains).astype(np.float32, copy=False))
    return np.concatenate(parts)


def relight_stored_physically(
    stored: StoredTransport, light: Floats, gains: Mapping[str, float]
) -> Floats:
    """Relight the scene, as `nearfar.PhysicalSplit.relight` does.

    All of the transport is read at once: the camera pixels of a body share its medium.

    Parameters
    ----------
    stored : StoredTransport
    light : ndarray, shape (Py, Px) or (Py, Px, channels)
        As `nearfar.Transport.relight` takes it.
    gains : mapping of str to float
        Gain of each component, ``"direct"``, ``"subsurface"`` or ``"interreflection"``; 1 where
        left out.

    Returns
    -------
    ndarray, shape (Cy, Cx) or (Cy, Cx, channels), float32
        In photo units.

    Raises
    ------
    InputError
        If the transport cannot be split physically.
    """
    split = split_physically(stored.rows())
    return split.relight(light, **gains).astype(np.float32, copy=False)


def physical_error_bars_of_stored(
    stored: StoredTransport, light: Floats, gains: Mapping[str, float]
) -> Floats:
    """Return the standard deviation of what `relight_stored_physically` returns.

    See `nearfar.PhysicalErrorBars`.

    Raises
    ------
    InputError
        If the transport holds no error bars, or cannot be split physically.
    """
    bars = PhysicalErrorBars(split_physically(stored.rows()))
    return bars.picture(light, **gains).astype(np.float32, copy=False)


def error_bars_of_stored(
    stored: StoredTransport, light: Floats, gains: Mapping[str, float]
) -> Floats:
    """Return the standard deviation of what `relight_stored` returns; see `nearfar.ErrorBars`.

    Raises
    ------
    InputError
        If the transport holds no error bars, or does not have a part.
    """
    require_parts(stored.parts, gains)
    parts = (ErrorBars(rows).picture(light, **gains) for rows in stored.blocks())
    return np.concatenate([part.astype(np.float32, copy=False) for part in parts])
