"""Maps of how far a transport is off at photos, of the capture that it was reconstructed from."""

from collections.abc import Mapping

import numpy as np

from nearfar.arrays import Floats
from nearfar.capture import Capture
from nearfar.errors import InputError
from nearfar.progress import Report, ignore_progress
from nearfar.report.maps import Map
from nearfar.transport.stored import StoredTransport
from nearfar.workflow.diagnosis.misfit_maps import MisfitMaps, measure_misfit
from nearfar.workflow.verdict.keeping import require_origin

HELD_OUT, MISFIT = "held-out", "misfit"
# The largest values but for one in a hundred have colours of their own.
BRIGHTEST_PERCENTILE = 99


def photo_maps(
    stored: StoredTransport, capture: Capture, progress: Report = ignore_progress
) -> Mapping[str, Map]:
    """Compare a transport with the photos of its capture; return maps of it by name.

    Parameters
    ----------
    stored : StoredTransport
    capture : Capture
        The one that it was reconstructed from.
    progress : callable
        Called with the step and the share of it that is done.

    Returns
    -------
    mapping of str to Map
        The misfit of all photos, and what held-out photos are off by where there are any.

    Raises
    ------
    InputError
        If the capture is another one, or its photos do not tell their noise.
    UnreadableFileError
        If the transport or the capture is damaged.
    """
    require_origin(stored, capture)
    measured = measure_misfit(stored, capture, progress)
    if measured is None:
        raise InputError(
            f"the photos of {capture.path} do not tell their noise, or are saturated everywhere, "
            f"so that there is no map of how far the transport is off: leave out `capture`."
        )
    maps = {}
    if measured.of_held_out is not None:
        maps[HELD_OUT] = _map(
            "off at held-out photos",
            "%",
            100 * measured.of_held_out,
            measured,
            "How far relit pictures are off from photos that no estimate used, noise included, as "
            "a share of their light: high where the transport is wrong, and where it is dark.",
        )
    maps[MISFIT] = _map(
        "misfit of all photos",
        "",
        measured.of_camera,
        measured,
        "The squared difference of photos and relit pictures over what noise makes of it: 1 is "
        "noise alone, far more is what the model does not describe.",
    )
    return maps


def _map(title: str, unit: str, values: Floats, measured: MisfitMaps, reading: str) -> Map:
    found = np.where(measured.saturated, np.nan, values).astype(np.float32)
    finite = found[np.isfinite(found)]
    high = float(np.percentile(finite, BRIGHTEST_PERCENTILE)) if finite.size else 1.0
    return Map(title, unit, 0.0, high or 1.0, found, reading, measured.saturated)
