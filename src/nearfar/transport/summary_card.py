"""What a notebook shows of a transport."""

from typing import TYPE_CHECKING

import numpy as np

from nearfar.markup import card, picture
from nearfar.transport.plots import colours

if TYPE_CHECKING:
    from nearfar.transport.model import Transport

# Pixels along the longer side of a picture that a notebook shows.
THUMBNAIL = 256


def summary_card(transport: "Transport") -> str:
    """Return a transport as HTML: what it is, floodlit and taken apart."""
    step = -(-max(transport.camera) // THUMBNAIL)
    parts = transport.components(np.ones(transport.projector, dtype=np.float32))
    pictures = {"floodlit": np.asarray(sum(parts)), **transport.named(parts)}
    brightest = float(np.percentile(pictures["floodlit"], 99.5))
    images = [
        (name, picture(colours(part)[::step, ::step] / max(brightest, 1e-9), name))
        for name, part in pictures.items()
    ]
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
