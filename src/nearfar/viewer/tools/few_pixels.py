"""So few camera pixels of a transport that something is made of them at once, for a page."""

from math import ceil, sqrt

from nearfar.arrays import middles
from nearfar.transport.model import Transport
from nearfar.transport.rows import of_pixels
from nearfar.viewer.interactive import InteractiveTransport


def few_pixels(transport: InteractiveTransport, most: int) -> Transport:
    """Return one camera row and column in every few, about `most` pixels in all."""
    coarse = transport.coarse
    stride = ceil(sqrt(coarse.camera.pixels / most))
    return of_pixels(coarse, *(middles(side, stride) for side in coarse.camera))
