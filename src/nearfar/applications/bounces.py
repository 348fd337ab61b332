"""Light after each of its bounces: what the first, the second ... reflection adds to a picture.

After Seitz, Matsushita and Kutulakos, "A Theory of Inverse Light Transport", ICCV 2005. With the
picture L = T l and the first bounce L_1 = B l, B being direct light (and light under surfaces),
their interreflection cancellation operator is C = B T^-1, and the n-th bounce

    L_n = C (I - C)^(n-1) L.

They take T to be square: camera pixels and projector pixels are one to one, and light is reflected
between the surfaces that both see. Here the unknown is the light y_n whose whole picture is L_n,

    T y_n = L_n,   L_(n+1) = L_n - B y_n = (T - B) y_n,

so that a bounce is found at every camera pixel, also where there is no direct light, and only y_n
is of the projector's size. With B^-1, which `nearfar.applications.onto_projector` stands for,

    (I + K) y_n = x_n,   K = B^-1 (T - B),   x_1 = l,   x_(n+1) = K y_n = B^-1 L_(n+1).

T is preconditioned by B that way: light that bounces on fades, so that K has the eigenvalues
a / (1 - a), for those of one bounce, 0 <= a < 1, and I + K those of 1 / (1 - a). GMRES takes some
seven steps a bounce, and no matrix.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.sparse.linalg import LinearOperator, gmres

from nearfar.applications.onto_projector import onto_projector, unseen_share
from nearfar.arrays import Floats
from nearfar.callbacks import Report, as_report
from nearfar.checks import as_count, as_light
from nearfar.errors import InputError
from nearfar.estimate.physical import PhysicalSplit
from nearfar.transport.exact import ExactTransport
from nearfar.transport.exact_operator import ExactOperator
from nearfar.transport.known import KnownTransport
from nearfar.transport.model import Transport

# Takes the first bounce and all the rest of the picture under a light apart.
Apart = Callable[[Floats], tuple[Floats, Floats]]
# Of GMRES: relative tolerance of y_n, steps of a cycle, and cycles.
TOLERANCE = 1e-5
STEPS = 40
CYCLES = 3
# Beyond these a scene breaks what the method assumes: the share of the projector's pixels that the
# camera does not see, and the share of a bounce's light that is negative. Where a third of the
# picture is dark, noise alone makes 1 % of the light negative.
MOST_UNSEEN = 0.02
MOST_NEGATIVE = 0.03


@dataclass(frozen=True, eq=False)
class Bounces:
    """Pictures of the first bounces of light, and how far the scene is one that they are known of.

    Attributes
    ----------
    pictures : ndarray, shape (n, Cy, Cx) or (n, Cy, Cx, channels), float32
        Photo units: the first, second ... bounce.
    later : ndarray, shape (Cy, Cx) or (Cy, Cx, channels), float32
        All bounces after these together. The sum of all is the relit picture.
    unseen : float
        Share of the projector's pixels, of those that light anything, that no camera pixel sees
        directly.
    residual : float
        Relative residual of the worst solution y_n; 0 if all are within the tolerance.

    Examples
    --------
    >>> found = nearfar.bounces(transport, light, 3)
    >>> found.pictures.shape
    (3, 8, 8)
    >>> bool(np.allclose(found.pictures.sum(axis=0) + found.later, transport @ light, atol=1e-6))
    True
    >>> found.faults
    ()
    """

    pictures: Floats
    later: Floats
    unseen: float
    residual: float

    @property
    def shares(self) -> tuple[float, ...]:
        """Share of each bounce in all the light of the relit picture; 0 without any light."""
        return self._all_shares[:-1]

    @property
    def later_share(self) -> float:
        """Share of all later bounces together."""
        return self._all_shares[-1]

    @property
    def _all_shares(self) -> tuple[float, ...]:
        lights = [float(part.sum(dtype=np.float64)) for part in (*self.pictures, self.later)]
        total = sum(lights)
        return tuple(light / total if total > 0 else 0.0 for light in lights)

    @property
    def negative(self) -> tuple[float, ...]:
        """Share of each bounce's light that is negative."""
        return tuple(map(_negative_share, self.pictures))

    @property
    def faults(self) -> tuple[str, ...]:
        """Where the scene breaks what the method assumes: what is wrong, how bad, and the cure."""
        found = []
        if self.unseen > MOST_UNSEEN:
            found.append(
                f"{self.unseen:.1%} of the projector's pixels light surfaces that the camera does "
                f"not see, where bounces are guessed from the pixels around: move the camera "
                f"closer to the projector, or trust the first bounce alone."
            )
        if self.residual > 0:
            found.append(
                f"the light that cancels a bounce is known to {self.residual:.1%} only, for light "
                f"hardly fades from bounce to bounce: trust the first bounce alone, and "
                f"reconstruct from more photos."
            )
        for number, (before, after) in enumerate(
            zip(self.shares, self.shares[1:], strict=False), 2
        ):
            if after > max(before, 0.0):
                found.append(
                    f"bounce {number} has {after:.1%} of the light and bounce {number - 1} "
                    f"{before:.1%}, though light fades between surfaces that the camera sees: "
                    f"trust the bounces before it alone, and reconstruct from more photos."
                )
        for number, share in enumerate(self.negative, 1):
            if share > MOST_NEGATIVE:
                found.append(
                    f"{share:.1%} of the light of bounce {number} is negative, which no light is: "
                    f"trust the bounces before it alone, and reconstruct from more photos."
                )
        return tuple(found)


def bounces(
    transport: Transport | PhysicalSplit | KnownTransport,
    light: Floats,
    count: int = 4,
    *,
    progress: Report | None = None,
) -> Bounces:
    """Take a relit picture apart by how often its light was reflected.

    The first bounce is direct light; of a physical split and of a known scene, light under
    surfaces besides. Give ``nearfar.split_physically(transport)`` where surfaces meet or are
    translucent, as its direct light is the better one there.

    Light on its way over surfaces that the projector does not light counts as one bounce from one
    lit surface to the next.

    Parameters
    ----------
    transport : Transport, PhysicalSplit, ExactTransport or ExactOperator
    light : ndarray, shape (Py, Px) or (Py, Px, channels)
    count : int
        Bounces, 1 or more.
    progress : callable, optional
        Called with what is being done and the share done, 0 to 1.

    Returns
    -------
    Bounces

    Raises
    ------
    InputError
        If it is none of these transports, has no direct light or parts that are not known apart, if
        the light does not fit, or `count` is less than 1.

    Notes
    -----
    The interreflection cancellation operators of Seitz, Matsushita and Kutulakos, "A Theory of
    Inverse Light Transport", ICCV 2005, with T at the camera's pixels and its inverse at the
    projector's.

    Examples
    --------
    >>> direct, second = nearfar.bounces(transport, light, 2).pictures
    >>> bool(np.allclose(direct, transport.components(light).direct))
    True
    """
    report = as_report(progress)
    count = as_count(count, "count", least=1)
    apart, whole = _apart(transport)
    projector, channels = whole.projector, whole.channels
    given = as_light(light, projector, channels).reshape(*projector, -1)
    white, _ = apart(np.ones(projector, dtype=np.float32))
    onto = onto_projector(whole.correspondence, white.reshape(-1, channels), projector)

    def undone(picture: Floats) -> Floats:
        return onto.undone(picture, lambda own: apart(own)[0])

    first, later = apart(given)
    pictures, residual = [first], 0.0
    wanted: Floats = np.broadcast_to(given, (*projector, channels)).astype(np.float64)
    for number in range(1, count):
        report("bounces", number / count)
        cancelling, left = _solved(lambda own: undone(apart(own)[1]), wanted)
        _, rest = apart(cancelling)
        pictures.append(rest)
        later = later - rest
        residual = max(residual, left)
        wanted = undone(rest)
    reaching = whole.H @ np.ones((*whole.camera, channels), dtype=np.float32)
    unseen = unseen_share(onto, whole.correspondence, reaching.reshape(wanted.shape).sum(axis=2))
    report("bounces", 1.0)
    stacked = np.stack(pictures).astype(np.float32, copy=False)
    return Bounces(stacked, later.astype(np.float32, copy=False), unseen, residual)


def _apart(
    transport: Transport | PhysicalSplit | KnownTransport,
) -> tuple[Apart, Transport | KnownTransport]:
    """Return a function that takes the first bounce and the rest of a picture apart, and T."""
    match transport:
        case PhysicalSplit():

            def physical(light: Floats) -> tuple[Floats, Floats]:
                direct, subsurface, rest = transport.components(light)
                return direct + subsurface, rest

            return physical, transport.transport
        case Transport():
            if "direct" not in transport.parts:
                raise InputError(
                    "bounces cannot be told apart in a transport without direct light, such as "
                    "that of lamps: give one that was measured with a projector."
                )

            def modelled(light: Floats) -> tuple[Floats, Floats]:
                direct, near, far = transport.components(light)
                return direct, near + far

            return modelled, transport
        case ExactTransport() | ExactOperator():

            def known(light: Floats) -> tuple[Floats, Floats]:
                direct, subsurface, rest = transport.component_pictures(light)
                return direct + subsurface, rest

            return known, transport
        case _:
            raise InputError(
                f"a {type(transport).__name__} was given for the transport: give what "
                f"nearfar.load_transport, nearfar.split_physically or nearfar.load_exact returns."
            )


def _solved(bounce: Callable[[Floats], Floats], wanted: Floats) -> tuple[Floats, float]:
    """Solve (I + K) y = x; return y and the share of x that it leaves, 0 if as little as asked."""

    def product(flat: Floats) -> Floats:
        light = flat.reshape(wanted.shape)
        return (light + bounce(light)).ravel()

    operator = LinearOperator((wanted.size, wanted.size), matvec=product, dtype=np.float64)
    flat, failed = gmres(operator, wanted.ravel(), rtol=TOLERANCE, restart=STEPS, maxiter=CYCLES)
    if not failed:
        return flat.reshape(wanted.shape), 0.0
    left = np.linalg.norm(wanted.ravel() - product(flat)) / np.linalg.norm(wanted)
    return flat.reshape(wanted.shape), float(left)


def _negative_share(picture: Floats) -> float:
    """Return the share of a picture's light, in magnitude, that is negative."""
    total = float(np.abs(picture).sum(dtype=np.float64))
    below = float(np.maximum(-picture, 0).sum(dtype=np.float64))
    return below / total if total > 0 else 0.0
