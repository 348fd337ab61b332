"""Which media hardly fade as far as responses tell of them."""

import numpy as np
import pytest

from nearfar.estimate.physical.kernels import source_at
from nearfar.estimate.physical.medium import RANGES, Media, is_even

FADES = source_at(0.6, 0.5)
HARDLY_FADES = source_at(0.6, RANGES[1][0] / 0.6)
DEEP = source_at(RANGES[0][1], 0.5 / RANGES[0][1])


@pytest.mark.parametrize(
    ("sources", "even"),
    [
        ((FADES, FADES, FADES), False),
        ((HARDLY_FADES, FADES, FADES), False),
        ((HARDLY_FADES, HARDLY_FADES, FADES), True),
        ((FADES, DEEP, FADES), True),
        ((FADES,), False),
        ((HARDLY_FADES,), True),
        ((HARDLY_FADES, FADES), True),
    ],
)
def test_light_is_even_that_is_deep_or_hardly_fades_in_half_of_the_channels(sources, even):
    nothing = np.empty(0)
    media = Media(sources, nothing.astype(int), nothing, nothing, nothing)
    assert is_even(media) == even
