"""Pictures of light that was reflected once, taken back to the light that caused them.

Index convention: c is a camera pixel, p a projector pixel, i a channel.

Under a light x the first bounce is the picture v_ci = sum_p B_cpi x_pi, where B_c lies about q(c).
Its ratio to b, the first bounce under white, is x(q(c)) wherever x hardly varies over a pixel. So
the ratio's mean over the camera pixels about p, each weighted by its bilinear share of p and by
b_ci^2, as noise of v asks for, gives x_pi:

    x_pi = sum_c h_cp b_ci v_ci / sum_c h_cp b_ci^2.

A mean blurs. So the same mean of the residual, v less the first bounce under x, is added to x.
Projector pixels that light no camera pixel directly are filled in from the values around them, from
coarser ones where the gap is wide (pull-push: Gortler et al., The Lumigraph, 1996).
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy import ndimage

from nearfar.arrays import Booleans, Floats, Size
from nearfar.transport.direct import Footprint, footprint, spread

# Projector pixels that give less direct light than this share of the usual count as giving none.
LEAST_LIGHT = 0.01
# A projector pixel lights something if more than this share of the usual light reaches the camera
# from it. An estimate has up to 3 %, of either sign, where nothing is lit; surfaces that the camera
# does not see send it 8 % by way of others.
LEAST_REACHING = 0.05


@dataclass(frozen=True, eq=False)
class OntoProjector:
    """Takes pictures of light that was reflected once back to light of the projector.

    Attributes
    ----------
    projector : Size
    where : Footprint
        Of every camera pixel.
    white : ndarray, shape (C, channels), float64
        b, the first bounce under white.
    weights : ndarray, shape (Py, Px, channels), float64
        Of each projector pixel; 0 where no camera pixel is lit by it.
    """

    projector: Size
    where: Footprint
    white: Floats
    weights: Floats

    def __call__(self, picture: Floats) -> Floats:
        """Return one mean of a picture (Cy, Cx) or (Cy, Cx, channels): (Py, Px, channels)."""
        values = self.white * picture.reshape(self.white.shape)
        sums = _spread(values, self.where, self.projector)
        return _filled(np.where(self.weights > 0, sums, 0.0), self.weights)

    def undone(self, picture: Floats, first_bounce: Callable[[Floats], Floats]) -> Floats:
        """Return the light (Py, Px, channels) whose first bounce is a picture.

        Parameters
        ----------
        picture : ndarray, shape (Cy, Cx) or (Cy, Cx, channels)
        first_bounce : callable
            Returns the picture of the first bounce under a light (Py, Px, channels).
        """
        light = self(picture)
        return np.asarray(light + self(picture - first_bounce(light)))

    @property
    def seen(self) -> Booleans:
        """Projector pixels that light a camera pixel directly in some channel, (Py, Px)."""
        return np.asarray(self.weights.max(axis=2) > 0)


def onto_projector(correspondence: Floats, white: Floats, projector: Size) -> OntoProjector:
    """Prepare to take pictures back to the projector.

    Parameters
    ----------
    correspondence : ndarray, shape (Cy, Cx, 2)
        q; NaN where there is no direct light.
    white : ndarray, shape (C, channels)
        The first bounce under white.
    projector : Size
    """
    where = footprint(correspondence, projector)
    white = np.asarray(white, dtype=np.float64)
    weights = _spread(white**2, where, projector)
    usual = float(np.median(np.abs(white[white != 0]))) if white.any() else 0.0
    weights[weights <= (LEAST_LIGHT * usual) ** 2] = 0.0
    return OntoProjector(projector, where, white, weights)


def unseen_share(onto: OntoProjector, correspondence: Floats, reaching: Floats) -> float:
    """Return the share of the projector's light-giving pixels that no camera pixel sees directly.

    Parameters
    ----------
    onto : OntoProjector
    correspondence : ndarray, shape (Cy, Cx, 2)
        q.
    reaching : ndarray, shape (Py, Px)
        Light from each projector pixel that reaches the camera by any way.
    """
    if not onto.seen.any():
        return 1.0
    gives = reaching > LEAST_REACHING * np.median(reaching[onto.seen])
    # A camera coarser than the projector sees the pixels between its own, too.
    far = ndimage.distance_transform_edt(~onto.seen) > max(1.0, _spacing(correspondence))
    return float((far & gives).sum() / max(1, gives.sum()))


def _spacing(correspondence: Floats) -> float:
    """Return the usual distance of neighbouring camera pixels' q, in projector pixels."""
    steps = [
        np.hypot(*np.moveaxis(np.diff(correspondence, axis=axis), -1, 0)).ravel() for axis in (0, 1)
    ]
    known = np.concatenate(steps)
    known = known[np.isfinite(known)]
    return float(np.median(known)) if len(known) else 0.0


def _spread(values: Floats, where: Footprint, projector: Size) -> Floats:
    """Scatter values (C, channels) over the projector, shape (Py, Px, channels)."""
    planes = [spread(plane, where, projector).reshape(projector) for plane in values.T]
    return np.stack(planes, axis=-1)


def _filled(sums: Floats, weights: Floats) -> Floats:
    """Divide sums by weights, both (y, x, channels); where these are 0, by those around."""
    known = weights > 0
    means = np.divide(sums, weights, out=np.zeros_like(sums), where=known)
    if known.all() or max(sums.shape[:2]) == 1:
        return means
    height, width = sums.shape[:2]
    coarse = _filled(_halved(sums), _halved(weights))
    finer = ndimage.zoom(coarse, (2, 2, 1), order=1, mode="nearest", grid_mode=True)
    return np.where(known, means, finer[:height, :width])


def _halved(values: Floats) -> Floats:
    """Add squares of 2 x 2 values."""
    height, width = values.shape[:2]
    even = np.pad(values, ((0, height % 2), (0, width % 2), (0, 0)))
    return np.asarray(even.reshape((height + 1) // 2, 2, (width + 1) // 2, 2, -1).sum(axis=(1, 3)))
