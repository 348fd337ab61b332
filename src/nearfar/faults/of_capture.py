"""Faults of a whole capture, by its photos and by what was made of them."""

from collections.abc import Mapping
from typing import Any

from nearfar.capture import Capture
from nearfar.faults.records import (
    Fault,
    LightDrifted,
    PairsDoNotAdd,
    PhotosSaturated,
    RoundedToHalf,
)

# Limits above which each is a fault.
SATURATED_SHARE_OF_VALUES = 1e-4
DRIFT_SHARE_OF_WHITE = 0.05
ROUNDING_SHARE_OF_NOISE = 0.5
PAIR_EXCESS_SHARE_OF_WHITE = 0.01


def find_faults(capture: Capture, provenance: Mapping[str, Any]) -> list[Fault]:
    """Find what is wrong with the photos of a capture, and with the transport made of them.

    Parameters
    ----------
    capture : Capture
    provenance : mapping
        Of the transport that was reconstructed from it.

    Returns
    -------
    list of Fault
        Empty if all is well.
    """
    found: list[Fault] = []
    excess = float(provenance["excess_of_sums"])
    if abs(excess) > PAIR_EXCESS_SHARE_OF_WHITE:
        found.append(PairsDoNotAdd(capture.path, excess))
    rounding = float(provenance["rounding"])
    if rounding > ROUNDING_SHARE_OF_NOISE:
        found.append(RoundedToHalf(rounding))
    drift = provenance["drift"]
    if drift is not None and max(drift.values()) > DRIFT_SHARE_OF_WHITE:
        found.append(LightDrifted(capture.path, drift["lamp"], drift["ambient"]))
    return [*found, *find_saturation(str(capture.path), capture.saturated_share)]


def find_saturation(photos: str, share: float) -> list[Fault]:
    """Return the fault of photos with too many saturated values, if it is one.

    Parameters
    ----------
    photos : str
        What a message calls the photos.
    share : float
        Share of all their values at full scale.
    """
    return [PhotosSaturated(photos, share)] if share > SATURATED_SHARE_OF_VALUES else []
