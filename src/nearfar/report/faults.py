"""What is wrong with photos, or with what was made of them, in plain words and with the cure."""

from collections.abc import Mapping
from typing import Any

from nearfar.capture import SATURATED, Capture

# Lamp or ambient light that changed by more than this share of the lamp's is worth a warning.
DRIFT = 0.05
# Rounding of more than this share of the noise is worth a warning.
ROUNDED = 0.5
# Pairs that sum to more or less than white and black by this share of white are worth a warning.
NOT_LINEAR = 0.01


def faults_of(capture: Capture, provenance: Mapping[str, Any]) -> list[str]:
    """Tell what the photos themselves tell of a rig that is not linear or not steady.

    Parameters
    ----------
    capture : Capture
    provenance : mapping
        Of the transport that was reconstructed from it.

    Returns
    -------
    list of str
        A sentence each; none if all is well.
    """
    found = []
    excess = float(provenance["excess_of_sums"])
    if abs(excess) > NOT_LINEAR:
        found.append(
            f"in {capture.path} a pattern and its inverse sum to {abs(excess):.1%} "
            f"{'more' if excess > 0 else 'less'} than white and black: projector or camera is not "
            f"linear, or the lamp drifts; relighting will be wrong by about as much."
        )
    rounding = float(provenance["rounding"])
    if rounding > ROUNDED:
        found.append(
            f"float16 strays from the windows and bands by {rounding:.2g} of their noise: "
            f"reconstruct again without --half if that matters."
        )
    drift = provenance["drift"]
    if drift is not None and max(drift.values()) > DRIFT:
        found.append(
            f"in {capture.path} the lamp changed by {drift['lamp']:.1%}, and ambient light by "
            f"{drift['ambient']:.1%} of white: both were followed by the references and taken out, "
            f"but what changes between two of them is not seen."
        )
    if capture.saturated_share > SATURATED:
        found.append(
            f"{capture.saturated_share:.2%} of the values in {capture.path} are saturated: their "
            f"camera pixels will be wrong."
        )
    return found
