"""A Gaussian prior of a row of the transport, described by six numbers.

The near-range light of a bare wall, of wax and of a crease differs by orders of magnitude, and no
single Gaussian describes them all. The prior is therefore a set of components. Each camera pixel's
own photos choose its component and prior scale, by their evidence.
"""

from typing import NamedTuple


class PriorComponent(NamedTuple):
    """A zero-mean Gaussian prior of a row t, less direct light, about q.

    Everything is at unit prior scale: the standard deviation of near-range light at q is 1.

    Attributes
    ----------
    near_reach : float
        Projector pixels over which the standard deviation of near-range light falls by a factor e;
        0 for no near-range light.
    far_deviation : float
        Standard deviation of far-range light's response to DC.
    far_decay : float
        Cycles per pattern grid over which the standard deviation of far-range light's responses
        falls by a factor e.
    direct_spread : float
        Standard deviation of direct light outside its 2 x 2 footprint: independent on each of the
        3 x 3 projector pixels around q.
    roughness : float
        Standard deviation of the part of a window entry that is independent of its neighbours,
        over that of the smooth part.
    far_power : float
        The standard deviation of far-range light's responses falls by (1 + r)^-far_power as well, r
        in cycles per pattern grid: 2 for light with edges, whose spectrum has no end.
    """

    near_reach: float
    far_deviation: float
    far_decay: float
    direct_spread: float = 0.0
    roughness: float = 0.0
    far_power: float = 0.0
