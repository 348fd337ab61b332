"""Error bars of the physical split: how far its components are from physical truth.

At opaque surfaces direct light is as sure as the estimate has it, and inter-reflection errs by what
direct light and the picture err. At translucent ones the kernels decide. What they leave of the
responses, as a share, says how good they are; the errors of components go with the root of it.
"""

from dataclasses import replace

import numpy as np

from nearfar.arrays import Floats
from nearfar.checks import as_number, require_instance
from nearfar.estimate.error_bars import ErrorBars
from nearfar.estimate.physical.kernels import kernel
from nearfar.estimate.physical.responses import unit_direct
from nearfar.estimate.physical.split import PhysicalComponents, PhysicalSplit

# Standard deviation over the root of the share left: of direct light, times what kernels add at q;
# of subsurface light, times itself. Measured on the scenes cornell and cornell-aside.
OF_DIRECT = 1.0
# How well what a kernel adds at q is known at best, as a share of it: all of a body has the same
# error, which responses do not show. Measured on five scenes, none of them held out.
OF_KERNEL = 0.08
OF_SUBSURFACE = 0.5
# Of direct light where its footprint is of boxes, as a share of it: an estimate has too much or too
# little of the fastest waves, the same at all of a body. Measured on cornell and cornell-aside at
# 128x128.
OF_BOXES = 0.1
# Of direct light from other places than q, as a share of it: what neighbours tell.
OF_ELSEWHERE = 0.1
# Correlation of the two: what one gains the other loses.
CORRELATION = -0.5


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
        alone = np.eye(3)
        return PhysicalComponents(*(self._with_gains(*deviations, *gains) for gains in alone))

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
        return self._with_gains(*self._deviations(light), *gains)

    def _deviations(self, light: Floats) -> tuple[Floats, Floats, Floats]:
        """Return those of the whole picture, direct and subsurface light, (C, channels) each."""
        transport = self._split.transport
        shape = (transport.camera.pixels, transport.channels)
        of_picture = self._bars.picture(light).reshape(shape).astype(np.float64)
        of_direct = self._bars.direct().reshape(shape).astype(np.float64)
        under = self._split.components(light).subsurface.reshape(shape)
        direct = self._split.direct.reshape(shape)
        white = np.ones((1, transport.projector.pixels))
        of_under = np.zeros(shape)
        for body in self._split.bodies:
            left = np.sqrt(np.maximum(1 - body.explained, 0.0))[:, None]
            peaks = np.array([kernel(source, 1)[1, 1] for source in body.sources])
            known = np.hypot(OF_DIRECT * left, OF_KERNEL) * body.amplitude * peaks
            of_under[body.pixels] = OF_SUBSURFACE * left * under[body.pixels]
            if self._split.footprint is not None:
                taken = OF_BOXES * direct[body.pixels]
                known = np.hypot(known, taken)
                # Subsurface light lacks what direct light has too much of.
                whole = body.amplitude * body.under(white, transport.projector)
                taken *= under[body.pixels] / np.maximum(whole, np.finfo(np.float32).tiny)
                of_under[body.pixels] = np.hypot(of_under[body.pixels], taken)
            of_direct[body.pixels] = known
        factors = unit_direct(transport.factors)
        if self._split.footprint is not None:
            factors = replace(factors, boxes=self._split.footprint.reshape(-1, 4))
        lights = [factors.analyse(one[None]) for one in transport.lights(light)]
        lit = np.concatenate([factors.relit(one).direct for one in lights], axis=1)
        of_direct = of_direct * np.abs(lit)
        elsewhere, flat = self._split.elsewhere, np.asarray(transport.lights(light))
        told = OF_ELSEWHERE * np.abs(elsewhere.under(flat, transport.projector))
        of_direct[elsewhere.pixels] = np.hypot(of_direct[elsewhere.pixels], told)
        return of_picture, of_direct, of_under

    def _with_gains(
        self,
        of_picture: Floats,
        of_direct: Floats,
        of_under: Floats,
        direct: float,
        subsurface: float,
        interreflection: float,
    ) -> Floats:
        """Combine them: inter-reflection is the picture less the other two."""
        known = np.isfinite(of_picture)
        whole, one, other = (
            gain * np.where(known & np.isfinite(part), part, 0.0)
            for gain, part in (
                (interreflection, of_picture),
                (direct - interreflection, of_direct),
                (subsurface - interreflection, of_under),
            )
        )
        variance = whole**2 + one**2 + other**2 + 2 * CORRELATION * one * other
        found = np.where(known, np.sqrt(np.maximum(variance, 0.0)), np.inf)
        return np.asarray(self._split.transport.picture(found.astype(np.float32)))
