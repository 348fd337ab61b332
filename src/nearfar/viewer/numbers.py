"""Light of one camera pixel and of its components, with standard deviations, for a page."""

from typing import Any

import numpy as np

from nearfar.arrays import Floats
from nearfar.estimate.error_bars import ErrorBars
from nearfar.estimate.physical import PhysicalErrorBars
from nearfar.transport.rows import of_pixels
from nearfar.viewer.interactive import InteractiveTransport
from nearfar.viewer.messages import Light, LightHeader
from nearfar.viewer.physical import PhysicalRelighting

# Of the one camera pixel that is left.
ONLY = np.zeros(1, dtype=np.int64)


class PixelHeader(LightHeader):
    """The header of a light under which one camera pixel is looked at.

    Attributes
    ----------
    y, x : int
    """

    y: int
    x: int


def numbers_at(
    transport: InteractiveTransport, physical: PhysicalRelighting, header: PixelHeader, light: Light
) -> dict[str, Any]:
    """Return the light at a camera pixel as JSON types, channel by channel.

    Returns
    -------
    dict
        ``split``; ``light`` and ``sigma`` of the whole, and ``components``, the same of each by its
        name. A standard deviation that is not known is None.
    """
    levels = transport.for_channels(light.as_array())
    pixel = of_pixels(transport.camera_row(header.y), ONLY, np.array([header.x]))
    bars = ErrorBars(pixel) if pixel.posterior is not None else None
    whole: Floats
    if header.split == "physical" and physical.is_prepared:
        split = physical.pixels(np.array([header.y]), np.array([header.x]))
        parts = split.components(levels)._asdict()
        sigmas = PhysicalErrorBars(split).components(levels)._asdict() if bars else {}
    else:
        parts = pixel.named(pixel.components(levels))
        sigmas = {name: _sigma_of(bars, levels, name, pixel.parts) for name in parts if bars}
    whole = np.asarray(sum(parts.values()))
    return {
        "split": "physical" if "subsurface" in parts else "model",
        "light": _listed(whole),
        "sigma": _listed(bars.picture(levels)) if bars else None,
        "components": {
            name: {"light": _listed(part), "sigma": _listed(sigmas[name]) if bars else None}
            for name, part in parts.items()
        },
    }


def _sigma_of(bars: ErrorBars, levels: Floats, name: str, parts: tuple[str, ...]) -> Floats:
    """Return the standard deviation of one component alone."""
    return bars.picture(levels, **{part: float(part == name) for part in parts})


def _listed(values: Floats) -> list[float | None]:
    """Return the channels of one pixel; None for what is not finite."""
    return [float(value) if np.isfinite(value) else None for value in np.ravel(values)]
