"""What is held out under a pattern, of chosen error and noise."""

import numpy as np

from nearfar.workflow.verdict.check_pairs import CheckPair
from nearfar.workflow.verdict.held_out import HeldOutLight

SIGNAL = 0.1
WHITE = 0.5
VALUES = 10_000


def held_out_light(
    error: float,
    expected: float | None,
    *,
    noise: float = 1e-6,
    excess: float = 0.0,
    is_binary: bool = False,
    unmeasured: float | None = None,
) -> HeldOutLight:
    """Return the comparison under a pattern.

    Parameters
    ----------
    error, expected : float
        Power of the error, and what the error bars expect. The signal's is `SIGNAL`.
    noise : float
        Standard deviation of `error`, from the noise of the photos.
    excess : float
        Of the pattern and its inverse over white, as a share of white.
    is_binary : bool
        Whether it is a half-screen.
    unmeasured : float, optional
        Part of `expected` that photos without noise would leave; by default all.
    """
    noise_of_photo = noise * np.sqrt(VALUES)
    pair = CheckPair(
        VALUES,
        signal=SIGNAL,
        difference=error + noise_of_photo,
        of_sum=2 * noise_of_photo,
        excess=excess * WHITE,
        white=WHITE,
        noise=noise_of_photo,
        error_of_white=0.0,
        share_of_pattern=1.0,
    )
    unknown = expected if unmeasured is None else unmeasured
    return HeldOutLight("a pattern", is_binary, pair, expected, unknown)
