"""Direct light that missed its footprint, or that holds light of a neighbouring projector pixel.

An estimate takes direct light to come through a footprint of one projector pixel. What comes
through a wider one, or from a q that is off, is left next to q, and the camera pixel stands out
from those around it in two ways: of all its light more is next to q, and more is inter-reflection.
Inter-reflection over all light is smooth, as albedo cancels. What stands out in both ways is moved
to direct light; where a camera pixel has too little of both, direct light gives it back.
Inter-reflection that stands out by far more than the camera pixels around it differ from each other
is moved as well, if all of them are as bright. Camera pixels in shadow have nothing else: what
matters of them is how bright they are, as if they had the albedo of the one that they are next to.
"""

from dataclasses import replace

import numpy as np

from nearfar.arrays import Booleans, Floats
from nearfar.estimate.physical.around import neighbours
from nearfar.estimate.physical.rows_about import light_next_to_q
from nearfar.estimate.physical.split import DARK, PhysicalSplit, opaque

# A camera pixel stands out if it lies beyond all but one of the eight about it: a line of them,
# such as a crease, does not.
EXCEPTIONS = 1
# By how many times what those about it differ by, without these exceptions, it stands out far.
FAR_OUT = 2.0
# Of all light, how much less or more than theirs is as bright.
AS_BRIGHT = 0.15


def without_specks(split: PhysicalSplit) -> PhysicalSplit:
    """Return a split whose opaque camera pixels do not stand out from those around them.

    Parameters
    ----------
    split : PhysicalSplit

    Returns
    -------
    PhysicalSplit
    """
    transport = split.transport
    shape = transport.direct.shape
    white = np.ones(transport.projector, dtype=np.float32)
    parts = [np.reshape(part, shape) for part in split.components(white)]
    total = np.maximum(np.asarray(sum(parts)), DARK)
    chosen = opaque(split)
    chosen.ravel()[split.elsewhere.pixels] = False
    # Camera pixels without direct light have nothing but inter-reflection: next to a shadow, others
    # that are partly in it do not stand out.
    excess = _standing_out(parts[2] / total)
    excess_next_to_q = _standing_out(light_next_to_q(transport, transport.lit) / total)
    alike = chosen[..., None] & (excess * excess_next_to_q > 0)
    least = np.minimum(np.abs(excess), np.abs(excess_next_to_q))
    change = np.where(alike, np.sign(excess) * least * total, 0.0)
    beyond, alone = _alone(parts[2], total, chosen, ~transport.lit & np.any(total > DARK, axis=-1))
    change = np.where((chosen & alone)[..., None], beyond * total, change)
    return replace(split, direct=split.direct + change.astype(np.float32))


def _standing_out(share: Floats) -> Floats:
    """Return by how much each camera pixel lies beyond those around it."""
    return _beyond(share, neighbours(share))


def _beyond(share: Floats, around: Floats) -> Floats:
    """Return by how much each camera pixel lies beyond the eight values around it."""
    ordered = np.sort(around, axis=0)
    return np.asarray(share - np.clip(share, ordered[EXCEPTIONS], ordered[-1 - EXCEPTIONS]))


def _alone(
    light: Floats, total: Floats, chosen: Booleans, shadow: Booleans
) -> tuple[Floats, Booleans]:
    """Return by how much each share lies beyond those around it, and where far, (Cy, Cx).

    The eight around are chosen and as bright, or in shadow.
    """
    in_shadow = neighbours(shadow.astype(float)) > 0
    as_here = neighbours(light) / total
    around = np.where(in_shadow[..., None], as_here, neighbours(light / total))
    share = (light / total).mean(axis=-1)
    grey = around.mean(axis=-1)
    ordered = np.sort(grey, axis=0)
    spread = ordered[-1 - EXCEPTIONS] - ordered[EXCEPTIONS]
    found = np.abs(_beyond(share, grey)) > FAR_OUT * spread
    brightness = total.mean(axis=-1)
    bright = np.sort(neighbours(brightness), axis=0)
    found &= brightness > (1 - AS_BRIGHT) * bright[EXCEPTIONS]
    found &= brightness < (1 + AS_BRIGHT) * bright[-1 - EXCEPTIONS]
    surrounded = np.all(neighbours((chosen | shadow).astype(float)) > 0, axis=0)
    return _beyond(light / total, around), np.asarray(found & surrounded)
