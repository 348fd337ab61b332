"""Which media hardly fade as far as responses tell of them."""

import numpy as np
import pytest

from nearfar.estimate.physical.kernels import source_at
from nearfar.estimate.physical.medium import RANGES, Media, is_even

FADES = source_at(0.6, 0.5)
HARDLY_FADES = source_at(0.6, RANGES[1][0] / 0.6)
DEEPEST = source_at(RANGES[0][1], 0.5 / RANGES[0][1])
DEEP = source_at(2.4, 0.5 / 2.4)
DEEP_AND_HARDLY_FADES = source_at(2.4, RANGES[1][0] / 2.4)


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
    nothing = np.empty(0)
    media = Media(sources, nothing.astype(int), nothing, nothing, nothing)
    assert is_even(media) == even
