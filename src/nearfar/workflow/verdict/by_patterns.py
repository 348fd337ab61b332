"""Held-out SNR_b of a capture of anybody's patterns, by photos left out of an estimate."""

from collections.abc import Sequence

import numpy as np

from nearfar.arrays import Booleans, Floats
from nearfar.transport.model import Transport
from nearfar.transport.verdict import PATTERNS_SHOWN
from nearfar.workflow.verdict.bars import bars_of, expected_and_unmeasured
from nearfar.workflow.verdict.held_out import HeldOut, HeldOutLight
from nearfar.workflow.verdict.weighed_photos import compare_weighed


def compare_with_photos(
    transport: Transport,
    patterns: Floats,
    photos: Floats,
    usable: Booleans,
    descriptions: Sequence[str],
) -> HeldOut:
    """Compare a transport with photos of patterns that its estimate did not see.

    Parameters
    ----------
    transport : Transport
        Of C camera pixels, estimated without these photos.
    patterns : ndarray, shape (L, P)
    photos : ndarray, shape (C, channels, L)
    usable : ndarray of bool, shape (C,)
        Camera pixels that are compared.
    descriptions : sequence of str
        What the patterns are.
    """
    size, projector = (transport.camera.pixels, transport.channels), transport.projector
    bars = bars_of(transport)
    white = (transport @ np.ones(projector, np.float32)).reshape(size)[usable]
    black = transport.black.reshape(size)[usable]
    # A camera pixel's noise is known by its own photos.
    noise = float(np.mean(transport.noise.reshape(size)[usable].astype(np.float64) ** 2))
    drawn = list(patterns.reshape(-1, *projector))
    expected = expected_and_unmeasured(bars, drawn, usable)
    lights = []
    for number, description in enumerate(descriptions):
        compared = compare_weighed(
            photos[usable, :, number] - black,
            (transport @ drawn[number]).reshape(size)[usable],
            level=0.0,
            white=white,
            noise=noise,
        )
        lights.append(HeldOutLight(description, False, compared, *expected[number]))
    return HeldOut(tuple(lights), called=PATTERNS_SHOWN)
