"""Error bars under several lights at once."""

import numpy as np

from nearfar.estimate import error_bars
from nearfar.estimate.error_bars import ErrorBars
from nearfar.transport.model import Transport


def assert_each_light_has_its_own_errors(transport: Transport) -> None:
    """Compare mean squares under lights together, more than fit at once, with each of them alone.

    One of the lights is of as many channels as the transport.
    """
    generator = np.random.default_rng(4)
    lights = list(generator.random((error_bars.LIGHTS_TOGETHER, *transport.projector)))
    lights += [
        generator.random((*transport.projector, transport.channels)),
        np.eye(*lights[0].shape),
    ]
    bars = ErrorBars(transport)
    alone = [bars.mean_squares(light) for light in lights]
    together = bars.mean_squares_under(lights)
    assert len(together) == len(lights)
    for one, its_own in zip(together, alone, strict=True):
        assert one.shape == its_own.shape
        # Where a light hardly falls, its errors are small differences.
        np.testing.assert_allclose(one, its_own, rtol=1e-4, atol=1e-6 * its_own.max())
    assert bars.mean_squares_under([]) == []
    # Lights differ.
    assert len({round(float(one.sum() / alone[0].sum()), 9) for one in alone}) == len(lights)
