"""Optical Arnoldi: the scene itself multiplies by T, and a few products give T at low rank.

After O'Toole and Kutulakos 2010, "Optical Computing for Fast Light Transport Analysis". A light
r_k is projected, the photo l_k = T r_k is made orthogonal to all lights before it, and is projected
next. Camera and projector share an axis and a pixel grid, so that T is square and, by reciprocity,
symmetric: T^T l_k, with which T of other rigs would be multiplied next, is the photo of l_k too.

A light with negative parts is projected in two photos, of its positive and its negative parts, each
rounded to 8 bits. What counts from then on is the rounded light. Their difference has no black
level, so that no photo of black is needed.

The orthonormal lights V and their pictures L = T V leave (1 - V V^T) T (1 - V V^T) of a symmetric T
undetermined. It is taken to be 0, which gives T = L V^T + V L^T (1 - V V^T): light outside of V is
relit by symmetry. A T of rank n is exact after at most n + 1 lights, the first being white.

Direct light alone makes T of full rank. `estimate_direct` finds it beforehand by a checkerboard and
its inverse, under which it alone differs; the lights then explore T - D.

Index convention: k runs over lights, p over pixels of projector and camera.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from nearfar.arrays import Floats, Size
from nearfar.baselines.separation_patterns import checkerboards
from nearfar.baselines.shooting import Shooting
from nearfar.errors import InputError

PHOTOS_PER_LIGHT = 2
PHOTOS_OF_DIRECT = 2
# A photo that is known by the lights before it to this share of its norm gives no new light.
LEAST_NEWS = 1e-6


@dataclass(frozen=True, eq=False)
class LowRankTransport:
    """A symmetric transport that is known by its products with some lights, and a diagonal.

    Attributes
    ----------
    camera : Size
        Also that of the projector.
    lights : ndarray, shape (P, K), float64
        V, orthonormal.
    pictures : ndarray, shape (channels, P, K), float64
        T V less the direct light, in photo units.
    direct : ndarray, shape (P, channels), float64
        Direct light of each pixel under white; 0 where it was not found beforehand.
    """

    camera: Size
    lights: Floats
    pictures: Floats
    direct: Floats

    def __matmul__(self, light: Floats) -> Floats:
        flat = light.ravel().astype(np.float64)
        along = self.lights.T @ flat
        across = flat - self.lights @ along
        # Light outside of V, seen from its pictures: by symmetry V^T T = L^T.
        back = np.einsum("ipk,p->ik", self.pictures, across)
        lit = self.pictures @ along + back @ self.lights.T
        return np.asarray((lit.T + self.direct * flat[:, None]).reshape(*self.camera, -1))


def arnoldi(shooting: Shooting) -> LowRankTransport:
    """Measure T by as many lights as the photos allow.

    Parameters
    ----------
    shooting : Shooting
        Of a coaxial rig whose camera has the projector's pixels.

    Returns
    -------
    LowRankTransport
        Without direct light of its own: it is part of the pictures.

    Raises
    ------
    InputError
        If the photos do not suffice for one light, or the camera has other pixels than the
        projector.
    """
    _require_photos(shooting, PHOTOS_PER_LIGHT)
    return _explored(shooting, np.zeros((1, 1)))


def arnoldi_after_direct(shooting: Shooting) -> LowRankTransport:
    """Measure direct light D by two photos, and T - D by as many lights as the others allow.

    Parameters
    ----------
    shooting : Shooting
        Of a coaxial rig whose camera has the projector's pixels.

    Returns
    -------
    LowRankTransport

    Raises
    ------
    InputError
        If the photos do not suffice for direct light and one light, or the camera has other pixels
        than the projector.
    """
    _require_photos(shooting, PHOTOS_OF_DIRECT + PHOTOS_PER_LIGHT)
    return _explored(shooting, estimate_direct(shooting))


def _require_photos(shooting: Shooting, fewest: int) -> None:
    if shooting.left < fewest:
        raise InputError(
            f"{shooting.left} photos are too few for a light of optical Arnoldi: allow {fewest} or "
            f"more."
        )


def _explored(shooting: Shooting, direct: Floats) -> LowRankTransport:
    """Explore T less direct light, (P, channels) or (1, 1), with all photos that are left."""
    count = min(shooting.left // PHOTOS_PER_LIGHT, shooting.projector.pixels)
    generator = np.random.default_rng(2010)
    basis = np.empty((shooting.projector.pixels, count))
    lights, pictures = [], []
    wanted: Floats = np.ones(len(basis))
    for k in range(count):
        shown, picture = _multiply(shooting, wanted)
        picture = picture - direct * shown[:, None]
        lights.append(shown)
        pictures.append(picture)
        rest = _beyond(basis[:, :k], shown)
        basis[:, k] = rest / np.linalg.norm(rest)
        wanted = _next_light(basis[:, : k + 1], picture.mean(axis=1), generator)
    # Photos are of the rounded lights, V R: those of V follow from them.
    triangle = basis.T @ np.stack(lights, axis=1)
    products = np.stack(pictures, axis=2)
    normalised = np.linalg.solve(triangle.T, products.reshape(-1, count).T).T
    return LowRankTransport(
        shooting.camera,
        basis,
        np.moveaxis(normalised.reshape(products.shape), 1, 0),
        np.broadcast_to(direct, products.shape[:2]),
    )


def estimate_direct(shooting: Shooting) -> Floats:
    """Return the direct light of each pixel under white, (P, channels), from two photos.

    Global light is the same under a fine checkerboard and its inverse; direct light is there under
    one of them and not under the other.

    Raises
    ------
    InputError
        If the camera has other pixels than the projector.
    """
    board, inverse = checkerboards(shooting.projector, 1)
    lit, unlit = shooting.shoot(np.stack([board, inverse])).astype(np.float64)
    _require_square(shooting)
    sign = np.where(board.ravel() > 0, 1.0, -1.0)
    return np.asarray(sign[:, None] * (lit - unlit))


def _multiply(shooting: Shooting, wanted: Floats) -> tuple[Floats, Floats]:
    """Return a signed light as it was shown, (P,), at most 1, and its picture, (P, channels)."""
    levels = np.rint(255 * wanted / np.abs(wanted).max())
    parts = np.stack([np.maximum(levels, 0), np.maximum(-levels, 0)])
    patterns: NDArray[np.uint8] = parts.astype(np.uint8)
    positive, negative = shooting.shoot(patterns.reshape(2, *shooting.projector))
    _require_square(shooting)
    return levels / 255, positive.astype(np.float64) - negative


def _beyond(basis: Floats, vector: Floats) -> Floats:
    """Return the part of a vector, (P,), that is orthogonal to a basis, (P, K)."""
    # Once more, as rounding leaves a rest of the basis in what is small beside it.
    for _ in range(2):
        vector = vector - basis @ (basis.T @ vector)
    return vector


def _next_light(basis: Floats, picture: Floats, generator: np.random.Generator) -> Floats:
    """Return the part of a picture, (P,), outside the basis; a random one if it is negligible."""
    rest = _beyond(basis, picture)
    if np.linalg.norm(rest) > LEAST_NEWS * np.linalg.norm(picture):
        return rest
    return _beyond(basis, generator.normal(size=len(picture)))


def _require_square(shooting: Shooting) -> None:
    if shooting.camera != shooting.projector:
        raise InputError(
            f"the camera has {shooting.camera} pixels and the projector {shooting.projector}: "
            f"optical Arnoldi projects what it sees, so give both the same pixels."
        )
