"""What an estimate believed of each camera pixel: what a transport's error bars follow from."""

from dataclasses import dataclass

import numpy as np

from nearfar.arrays import Floats, Integers
from nearfar.illumination.frequencies import Frequency
from nearfar.transport.kinds import Kind


@dataclass(frozen=True)
class Posterior:
    """Kinds, strengths and noise that a joint estimate ended with.

    Attributes
    ----------
    kinds : tuple of Kind
    frequencies : tuple of Frequency
        What was measured, one of each +-k, without DC.
    multiplicity : ndarray, shape (R,), float32
        How often each real answer was measured.
    kind : ndarray of uint8, shape (Cy, Cx)
        Place in `kinds`.
    strength : ndarray, shape (Cy, Cx), float32
        Deviation of near-range light at q, as a share of white.
    white : ndarray, shape (Cy, Cx, channels), float32
        Light under white, above 0, photo units.
    offset_noise : ndarray, shape (Cy, Cx, channels), float32
        Standard deviation of the error that the references add to every answer.
    light_noise : ndarray, shape (Cy, Cx, channels), float32
        Standard deviation of the answer to white.
    share_of_white : ndarray, shape (Cy, Cx, channels), float32
        How much of the references' error is, on average, that of the answer to white.
    """

    kinds: tuple[Kind, ...]
    frequencies: tuple[Frequency, ...]
    multiplicity: Floats
    kind: Integers
    strength: Floats
    white: Floats
    offset_noise: Floats
    light_noise: Floats
    share_of_white: Floats


def deviation_of_mean(deviations: Floats) -> Floats:
    """Return the deviation of a mean over channels that err independently, of theirs.

    Parameters
    ----------
    deviations : ndarray, shape (channels, ...)
    """
    return np.asarray(np.linalg.norm(deviations, axis=0) / len(deviations))
