"""Which media hardly fade as far as responses tell of them."""

import numpy as np
import pytest

from nearfar.estimate.physical.kernels import source_at
from nearfar.estimate.physical.medium import RANGES, Media, is_even, unlike_channels

FADES = source_at(0.6, 0.5)
HARDLY_FADES = source_at(0.6, RANGES[1][0] / 0.6)
DEEPEST = source_at(RANGES[0][1], 0.5 / RANGES[0][1])
DEEP = source_at(2.4, 0.5 / 2.4)
DEEP_AND_HARDLY_FADES = source_at(2.4, RANGES[1][0] / 2.4)


def media_of(sources):
    nothing = np.empty(0)
    return Media(tuple(sources), nothing.astype(int), nothing, nothing, nothing)


@pytest.mark.parametrize(
    ("sources", "even"),
    [
        ((FADES, FADES, FADES), False),
        ((HARDLY_FADES, FADES, FADES), False),
        ((HARDLY_FADES, HARDLY_FADES, FADES), False),
        ((HARDLY_FADES, HARDLY_FADES, HARDLY_FADES), True),
        ((FADES, DEEPEST, FADES), True),
        ((FADES, DEEP, FADES), False),
        ((HARDLY_FADES, DEEP, FADES), False),
        ((FADES, DEEP_AND_HARDLY_FADES, FADES), True),
        ((FADES,), False),
        ((HARDLY_FADES,), True),
    ],
)
def test_light_is_even_that_hardly_fades_in_all_channels_or_from_a_deep_source(sources, even):
    assert is_even(media_of(sources)) == even


@pytest.mark.parametrize(
    ("products", "unlike"),
    [
        ((0.2, 0.25, 0.4), ()),
        ((0.04, 0.25, 0.4), (0,)),
        # Of two that hardly fade, neither hides the other; a little more in one changes nothing.
        ((0.01, 0.01, 0.22), (0, 1)),
        ((0.01, 0.012, 0.227), (0, 1)),
        ((0.01, 0.025, 0.227), (0, 1)),
        # Where light fades, absorption may well be another in one channel.
        ((0.05, 0.06, 0.25), ()),
        ((0.01, 0.01, 0.02), ()),
        ((0.01,), ()),
    ],
)
def test_channels_in_which_light_hardly_fades_are_unlike_those_in_which_it_does(products, unlike):
    media = media_of(source_at(0.6, product / 0.6) for product in products)
    assert tuple(np.flatnonzero(unlike_channels(media))) == unlike
