"""Error bars of the physical split: how far its components are from physical truth.

At opaque surfaces direct light is as sure as the estimate has it, and inter-reflection errs by what
direct light and the picture err; where inter-reflection was smoothed, by less. At translucent ones
the kernels decide. What they leave of the responses, as a share, says how good they are; the errors
of components go with the root of it. Those of direct and subsurface light are larger where sources
are shallow.
"""

from dataclasses import replace
from typing import NamedTuple

import numpy as np
from scipy import ndimage

from nearfar.arrays import Booleans, Floats
from nearfar.checks import as_number, require_instance
from nearfar.estimate.error_bars import ErrorBars
from nearfar.estimate.physical.kernels import kernel
from nearfar.estimate.physical.responses import unit_direct
from nearfar.estimate.physical.split import (
    PhysicalComponents,
    PhysicalSplit,
    Translucent,
    on_bodies,
)
from nearfar.estimate.physical.translucent import SQUARE

# Standard deviations at translucent surfaces, over the root of the share that kernels leave: of
# direct light, times what kernels add at q; of subsurface light, times itself; of inter-reflection,
# times subsurface light, and times itself. These and the next three were measured on nine scenes
# (docs/decisions/0118, 0123).
OF_DIRECT, OF_SUBSURFACE = 0.5, 0.34
BY_SUBSURFACE, OF_INTERREFLECTION = 0.155, 1.0
# Of inter-reflection's, that root counts as much at least.
LEAST_ROOT_LEFT = 0.08
# The shallower its source, the less light under a surface differs from direct light. Direct and
# subsurface light are then less sure: their standard deviations go with this power of its depth in
# projector pixels. Beyond the second, depth makes no difference: hardly any source was deeper where
# this was measured.
POWER_OF_DEPTH, LARGEST_DEPTH = -0.85, 1.0
# Of the estimate's own standard deviation of direct light: a shared kernel leaves that much of it.
OF_ESTIMATE = 0.6
# The same at opaque surfaces.
OF_ESTIMATE_IF_OPAQUE = 0.88
# Of direct light at the outlines of translucent bodies, where a camera pixel sees a part of one, as
# a share of it.
OF_OUTLINE = 0.1
# Of direct light where its footprint is of boxes, as a share of it: an estimate has too much or too
# little of the fastest waves, the same at all of a body. Measured on cornell and cornell-aside at
# 128x128.
OF_BOXES = 0.1
# Of direct light from other places than q, as a share of it: what neighbours tell.
OF_ELSEWHERE = 0.1


class _OfBody(NamedTuple):
    """Standard deviations on a translucent body, each (n, channels).

    Attributes
    ----------
    direct, subsurface, interreflection : ndarray
        Of direct light under white; of subsurface light and inter-reflection under some light.
    """

    direct: Floats
    subsurface: Floats
    interreflection: Floats


class _Deviations(NamedTuple):
    """What the errors of components follow from, each (C, channels).

    Attributes
    ----------
    of_picture, of_direct, of_under, exchanged, of_white : ndarray
        Standard deviations of the whole picture, of direct light before inter-reflection was
        smoothed, of subsurface light, of what one of these two has of the other's at the outlines
        of bodies, and of all light under white times that from q.
    covariance : ndarray
        Of direct and subsurface light.
    smoothed : ndarray
        Share of inter-reflection that neighbours tell.
    """

    of_picture: Floats
    of_direct: Floats
    of_under: Floats
    exchanged: Floats
    of_white: Floats
    covariance: Floats
    smoothed: Floats


class PhysicalErrorBars:
    """Standard deviations of the physical components' errors against physical truth.

    Where a camera pixel is saturated under white, they are infinite; see `nearfar.ErrorBars`.

    Parameters
    ----------
    split : PhysicalSplit

    Raises
    ------
    InputError
        If the transport holds no error bars.

    Examples
    --------
    >>> bars = nearfar.PhysicalErrorBars(nearfar.split_physically(transport))
    >>> direct, subsurface, interreflection = bars.components(light)
    >>> bars.picture(light, subsurface=2.0).shape  # that of `split.relight`
    (8, 8)
    """

    def __init__(self, split: PhysicalSplit) -> None:
        require_instance(split, PhysicalSplit, "split", "nearfar.split_physically")
        self._split = split
        self._bars = ErrorBars(split.transport)

    def components(self, light: Floats) -> PhysicalComponents:
        """Return the standard deviation of each component under a light.

        Parameters
        ----------
        light : ndarray, shape (Py, Px) or (Py, Px, channels)

        Returns
        -------
        PhysicalComponents
            Photo units; 0 for subsurface light where no translucent surface was found.

        Raises
        ------
        InputError
            As `Transport.components`.
        """
        deviations = self._deviations(light)
        return PhysicalComponents(*(self._with_gains(deviations, *gains) for gains in np.eye(3)))

    def picture(
        self,
        light: Floats,
        *,
        direct: float = 1.0,
        subsurface: float = 1.0,
        interreflection: float = 1.0,
    ) -> Floats:
        """Return the standard deviation of a relit picture.

        Parameters
        ----------
        light : ndarray, shape (Py, Px) or (Py, Px, channels)
        direct, subsurface, interreflection : float
            Gains, as `PhysicalSplit.relight` takes them.

        Returns
        -------
        ndarray, shape (Cy, Cx) or (Cy, Cx, channels)
            Photo units.

        Raises
        ------
        InputError
            As `PhysicalSplit.relight`.
        """
        given = {"direct": direct, "subsurface": subsurface, "interreflection": interreflection}
        gains = [as_number(gain, f"the gain of {name}") for name, gain in given.items()]
        return self._with_gains(self._deviations(light), *gains)

    def _deviations(self, light: Floats) -> "_Deviations":
        """Return the standard deviations that those of components follow from."""
        transport = self._split.transport
        shape = (transport.camera.pixels, transport.channels)
        of_picture = self._bars.picture(light).reshape(shape).astype(np.float64)
        # Where nothing is known, the picture's are infinite: that says it of all components.
        of_estimate = finite(self._bars.direct().reshape(shape).astype(np.float64))
        _, under, rest = (part.reshape(shape) for part in self._split.components(light))
        direct = self._split.direct.reshape(shape)
        of_direct, of_under, of_rest = OF_ESTIMATE_IF_OPAQUE * of_estimate, *np.zeros((2, *shape))
        for body in self._split.bodies:
            own = _deviations_on(self._split, body, of_estimate, under, rest)
            of_direct[body.pixels], of_under[body.pixels], of_rest[body.pixels] = own
        at_outlines = OF_OUTLINE * np.abs(direct) * _outlines(self._split).reshape(-1, 1)
        within = on_bodies(self._split).reshape(-1, 1)
        of_direct = np.hypot(of_direct, at_outlines * ~within)
        factors = unit_direct(transport.factors)
        if self._split.footprint is not None:
            factors = replace(factors, boxes=self._split.footprint.reshape(-1, 4))
        lights = [factors.analyse(one[None]) for one in transport.lights(light)]
        lit = np.concatenate([factors.relit(one).direct for one in lights], axis=1)
        of_direct, exchanged = of_direct * np.abs(lit), at_outlines * within * np.abs(lit)
        # What inter-reflection has too much of is lacking elsewhere: far from q, subsurface light.
        of_under = np.sqrt(np.maximum(of_under**2, of_rest**2 - of_direct**2))
        covariance = _covariances(of_direct, of_under, of_rest)
        elsewhere, flat = self._split.elsewhere, np.asarray(transport.lights(light))
        told = OF_ELSEWHERE * np.abs(elsewhere.under(flat, transport.projector))
        of_direct[elsewhere.pixels] = np.hypot(of_direct[elsewhere.pixels], told)
        smoothed: Floats = np.zeros(shape)
        of_white: Floats = np.zeros(shape)
        if self._split.own_share is not None:
            smoothed = 1 - np.repeat(self._split.own_share.reshape(-1, 1), transport.channels, 1)
            every = np.ones(transport.projector, dtype=np.float32)
            of_white = finite(self._bars.picture(every).reshape(shape)) * np.abs(lit)
            of_white *= OF_ESTIMATE_IF_OPAQUE
        return _Deviations(
            of_picture, of_direct, of_under, exchanged, of_white, covariance, smoothed
        )

    def _with_gains(
        self, deviations: "_Deviations", direct: float, subsurface: float, interreflection: float
    ) -> Floats:
        """Combine them: inter-reflection is the picture less the other two."""
        of_picture, of_direct, of_under, exchanged, of_white, covariance, smoothed = deviations
        known, beyond = np.isfinite(of_picture), direct - interreflection
        of_picture = finite(of_picture)
        # Direct light has the error of the light under white that it was told from.
        common = np.minimum(of_picture, of_white)
        whole = interreflection * common + beyond * smoothed * of_white
        apart = interreflection**2 * (of_picture**2 - common**2)
        one = beyond * (1 - smoothed) * of_direct
        under = subsurface - interreflection
        # Of what neighbours tell, their errors are left.
        of_others = beyond**2 * smoothed * (1 - smoothed) * (of_white**2 + of_direct**2) + apart
        variance = whole**2 + one**2 + (under * of_under) ** 2 + of_others
        variance += 2 * beyond * under * covariance
        variance += ((direct - subsurface) * exchanged) ** 2
        found = np.where(known, np.sqrt(np.maximum(variance, 0.0)), np.inf)
        return np.asarray(self._split.transport.picture(found.astype(np.float32)))


def root_left(body: Translucent) -> Floats:
    """Return the root of the share of a body's responses that kernels leave, (n, 1)."""
    return np.sqrt(np.maximum(1 - body.explained, 0.0))[:, None]


def at_q_of_kernels(body: Translucent) -> Floats:
    """Return the subsurface light that comes from q under white, (n, channels)."""
    peaks = np.array([kernel(source, 1)[1, 1] for source in body.sources])
    return np.asarray(body.amplitude * peaks)


def taken_by_boxes(split: PhysicalSplit, body: Translucent) -> Floats:
    """Return how much direct light has too much or too little under white, (n, channels).

    It is subsurface light's, and 0 where footprints are of single projector pixels.
    """
    of_body = split.direct.reshape(-1, len(body.sources))[body.pixels]
    return np.asarray((0.0 if split.footprint is None else OF_BOXES) * of_body)


def _deviations_on(
    split: PhysicalSplit, body: Translucent, of_estimate: Floats, under: Floats, rest: Floats
) -> _OfBody:
    """Return standard deviations of the components on a body.

    Parameters
    ----------
    split : PhysicalSplit
    body : Translucent
        One of the split's.
    of_estimate : ndarray, shape (C, channels)
        Standard deviation of the estimate's direct light.
    under, rest : ndarray, shape (C, channels)
        Subsurface light and inter-reflection under some light.

    Returns
    -------
    _OfBody
    """
    left = root_left(body)
    depths = np.array([source.real for source in body.sources])
    shallow = np.minimum(depths, LARGEST_DEPTH) ** POWER_OF_DEPTH
    of_direct = OF_DIRECT * left * shallow * at_q_of_kernels(body)
    of_direct = np.hypot(of_direct, OF_ESTIMATE * of_estimate[body.pixels])
    of_under = OF_SUBSURFACE * left * shallow * under[body.pixels]
    light = BY_SUBSURFACE * under[body.pixels], OF_INTERREFLECTION * rest[body.pixels]
    of_rest = np.hypot(left, LEAST_ROOT_LEFT) * np.hypot(*light)
    if split.footprint is None:
        return _OfBody(of_direct, of_under, of_rest)
    taken = taken_by_boxes(split, body)
    of_direct = np.hypot(of_direct, taken)
    # Subsurface light lacks what direct light has too much of.
    white = np.ones((1, split.transport.projector.pixels))
    whole = body.amplitude * body.under(white, split.transport.projector)
    taken = taken * under[body.pixels] / np.maximum(whole, np.finfo(np.float32).tiny)
    return _OfBody(of_direct, np.hypot(of_under, taken), of_rest)


def _covariances(of_direct: Floats, of_under: Floats, of_rest: Floats) -> Floats:
    """Return the covariance of direct and subsurface light: what one gains the other loses.

    Inter-reflection has the errors of both, by which they are told.
    """
    together = of_rest**2 - of_direct**2 - of_under**2
    return np.asarray(np.clip(together / 2, -of_direct * of_under, 0.0))


def _outlines(split: PhysicalSplit) -> Booleans:
    """Return camera pixels on both sides of the outlines of translucent bodies, (Cy, Cx)."""
    within = on_bodies(split)
    about = ndimage.binary_dilation(within, SQUARE) & split.transport.lit
    return np.asarray(about & ~ndimage.binary_erosion(within, SQUARE))


def finite(deviations: Floats) -> Floats:
    """Return standard deviations, 0 in place of infinite ones."""
    return np.where(np.isfinite(deviations), deviations, 0.0)
