"""Direct, near- and far-range light apart."""

from typing import NamedTuple

from nearfar.arrays import Floats


class Components(NamedTuple):
    """Pictures under one light, each (Cy, Cx) or (Cy, Cx, channels)."""

    direct: Floats
    near: Floats
    far: Floats
