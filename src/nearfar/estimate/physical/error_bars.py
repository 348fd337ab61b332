"""Error bars of the physical split: how far its components are from physical truth.

At opaque surfaces direct light is as sure as the estimate has it, and inter-reflection errs by what
direct light and the picture err. At translucent ones the kernels decide. What they leave of the
responses, as a share, says how good they are; the errors of components go with the root of it.
"""

import numpy as np

from nearfar.arrays import Floats
from nearfar.checks import require_instance
from nearfar.estimate.error_bars import ErrorBars
from nearfar.estimate.physical.kernels import kernel
from nearfar.estimate.physical.responses import unit_direct
from nearfar.estimate.physical.split import PhysicalComponents, PhysicalSplit

# Standard deviation over the root of the share left: of direct light, times what kernels add at q;
# of subsurface light, times itself. Measured on the scenes cornell and cornell-aside.
OF_DIRECT = 1.0
OF_SUBSURFACE = 0.5
# Correlation of the two: what one gains the other loses.
CORRELATION = -0.5


def physical_error_bars(split: PhysicalSplit, light: Floats) -> PhysicalComponents:
    """Return standard deviations of the components' errors against physical truth.

    Parameters
    ----------
    split : PhysicalSplit
    light : ndarray, shape (Py, Px) or (Py, Px, channels)

    Returns
    -------
    PhysicalComponents
        Photo units; subsurface light has none where no translucent surface was found.

    Raises
    ------
    InputError
        If the transport holds no error bars, or as `Transport.components`.

    Examples
    --------
    >>> split = nearfar.split_physically(transport)
    >>> direct, subsurface, interreflection = nearfar.physical_error_bars(split, light)
    >>> direct.shape
    (8, 8)
    """
    require_instance(split, PhysicalSplit, "split", "nearfar.split_physically")
    transport = split.transport
    shape = (transport.camera.pixels, transport.channels)
    bars = ErrorBars(transport)
    of_picture = bars.picture(light).reshape(shape)
    of_direct = bars.direct().reshape(shape).astype(np.float64)
    under = split.components(light).subsurface.reshape(shape)
    of_under = np.zeros(shape)
    for body in split.bodies:
        left = np.sqrt(np.maximum(1 - body.explained, 0.0))[:, None]
        peaks = np.array([kernel(source, 1)[1, 1] for source in body.sources])
        of_direct[body.pixels] = OF_DIRECT * left * body.amplitude * peaks
        of_under[body.pixels] = OF_SUBSURFACE * left * under[body.pixels]
    factors = unit_direct(transport.factors)
    lights = [factors.analyse(one[None]) for one in transport.lights(light)]
    lit = np.concatenate([factors.relit(one).direct for one in lights], axis=1)
    of_direct *= np.abs(lit)
    both = of_direct**2 + of_under**2 + 2 * CORRELATION * of_direct * of_under
    parts = (of_direct, of_under, np.sqrt(of_picture**2 + both))
    return PhysicalComponents(*(transport.picture(part.astype(np.float32)) for part in parts))
