"""What a notebook shows of a transport, and of its splits."""

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from nearfar.arrays import Floats
from nearfar.markup import card, picture
from nearfar.transport.plots import colours

if TYPE_CHECKING:
    from nearfar.transport.model import Transport

# Pixels along the longer side of a picture that a notebook shows.
THUMBNAIL = 256


def summary_card(transport: "Transport") -> str:
    """Return a transport as HTML: what it is, floodlit and taken apart."""
    parts = transport.components(np.ones(transport.projector, dtype=np.float32))
    images = floodlit_and_apart(transport.named(parts))
    verdict = transport.verdict
    rows = [
        ("projector", str(transport.projector)),
        ("camera", f"{transport.camera}, {transport.channels} channels"),
        ("parts", " + ".join(transport.parts)),
        ("window W, far coefficients", f"{transport.window}, {transport.far_basis.count}"),
        ("directly lit", f"{transport.lit.mean():.1%} of the camera"),
        ("verdict", verdict.grade if verdict is not None else "not judged"),
        ("error bars", "yes" if transport.has_error_bars else "no"),
        ("method", str(transport.provenance.get("method", "unknown"))),
    ]
    return card("transport", rows, images)


def floodlit_and_apart(parts: Mapping[str, Floats]) -> list[tuple[str, str]]:
    """Return thumbnails of a floodlit scene and of its components, as (name, <img>).

    Parameters
    ----------
    parts : mapping of str to ndarray, shape (Cy, Cx) or (Cy, Cx, channels)
        Under white, photo units; by the components' names.
    """
    floodlit = np.asarray(sum(parts.values()))
    step = -(-max(floodlit.shape[:2]) // THUMBNAIL)
    brightest = float(np.percentile(floodlit, 99.5))
    return [
        (name, picture(colours(part)[::step, ::step] / max(brightest, 1e-9), name))
        for name, part in {"floodlit": floodlit, **parts}.items()
    ]
