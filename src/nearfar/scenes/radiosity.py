"""Exact transport between patches, split into direct, near-range and far-range light.

Index convention: c is a camera pixel, p a projector pixel, i and j patches. With the flux phi that
falls on the patches, the reflection R (albedos on the diagonal, the dipole between the patches
of a translucent body), areas A and form factors F, radiosities are

    B = (I - R F)^-1 R (phi / A).

R / A is symmetric, positive definite: R / A = L L^T with L diagonal but for the translucent body,
and so, with G = A F symmetric,

    B = L K L^T phi,   K = (I - L^T G L)^-1,

a Cholesky factorisation. L L^T phi is what leaves after one reflection (direct and near-range);
L (K - I) L^T phi is all the rest, far-range. Of K only the rows and columns of patches that are lit
or seen are needed. The others come first: what the factorisation leaves after them is the Schur
complement, whose inverse is that part of K.
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from scipy import linalg, sparse

from nearfar.arrays import Floats, Integers, blocks
from nearfar.errors import NearfarError
from nearfar.scenes.camera import Gather
from nearfar.scenes.patches import Patches

ROWS_AT_ONCE = 1024


class ReflectionFactor(NamedTuple):
    """L with L L^T = R / A, in one channel: a diagonal, but for a translucent body.

    Attributes
    ----------
    scale : ndarray, shape (n,), float32
        The diagonal; 0 at the body's patches.
    places : ndarray of int, shape (m,)
        The body's patches.
    block : ndarray, shape (m, m), float32
        Lower triangle between them.
    """

    scale: Floats
    places: Integers
    block: Floats


def reflection_factor(
    albedo: Floats, patches: Patches, translucent: Integers, inside: Floats | None
) -> ReflectionFactor:
    """Factor R / A.

    Parameters
    ----------
    albedo : ndarray, shape (n,)
    patches : Patches
    translucent : ndarray of int, shape (m,)
        The patches of the translucent body.
    inside : ndarray, shape (m, m) or None
        Its dipole, per square metre.
    """
    scale = np.sqrt(albedo / patches.area).astype(np.float32)
    if inside is None:
        nothing = np.empty(0, dtype=np.int64)
        return ReflectionFactor(scale, nothing, np.empty((0, 0), dtype=np.float32))
    scale[translucent] = 0
    block = linalg.cholesky(np.diag((albedo / patches.area)[translucent]) + inside, lower=True)
    return ReflectionFactor(scale, translucent, np.tril(block).astype(np.float32))


def _between(factor: ReflectionFactor, block: Floats, matrix: Floats) -> None:
    """Replace a symmetric matrix M by X M X^T, X being the factor with `block` as its block."""
    columns = matrix[:, factor.places] @ block.T
    matrix *= factor.scale
    matrix[:, factor.places] = columns
    rows = block @ matrix[factor.places]
    matrix *= factor.scale[:, None]
    matrix[factor.places] = rows


def bounced(form: Floats, factor: ReflectionFactor, hidden: int = 0) -> Floats:
    """Return L (K - I) L^T, which takes the light that falls on patches to far-range light.

    Parameters
    ----------
    form : ndarray, shape (n, n), float32
        G, symmetric. Overwritten: it is the largest array of a scene.
    factor : ReflectionFactor
        L.
    hidden : int
        The first so many patches are left out of the result. None is of the translucent body.

    Returns
    -------
    ndarray, shape (n - hidden, n - hidden), float32, symmetric

    Raises
    ------
    NearfarError
        If more light is reflected than falls.
    """
    _between(factor, factor.block.T, form)
    np.negative(form, out=form)
    diagonal = np.einsum("ii->i", form)
    diagonal += 1
    # The transpose of a symmetric row-major array is what LAPACK wants, without a copy.
    lower, info = linalg.lapack.spotrf(form.T, lower=1, overwrite_a=1, clean=0)
    if info == 0:
        shown = lower[hidden:, hidden:]
        lower, info = linalg.lapack.spotri(shown, lower=1, overwrite_c=1)
    if info != 0:
        raise NearfarError("The scene reflects more light than falls on it: lower its albedos.")
    inverse = lower.T
    for rows in blocks(len(inverse), ROWS_AT_ONCE):
        square = inverse[rows, rows]
        inverse[rows, rows] = np.triu(square) + np.triu(square, 1).T
        inverse[rows.stop :, rows] = inverse[rows, rows.stop :].T
    diagonal = np.einsum("ii->i", inverse)
    diagonal -= 1
    of_shown = factor._replace(scale=factor.scale[hidden:], places=factor.places - hidden)
    _between(of_shown, factor.block, inverse)
    return np.asarray(inverse)


def components(
    gathered: Gather,
    patches: Patches,
    projector_pixels: int,
    form: Floats,
    *,
    albedo: Floats,
    translucent: Integers,
    inside: tuple[Floats, ...],
    hidden: int,
    progress: Callable[[float], None],
) -> tuple[list[sparse.csr_array], list[sparse.csr_array], Floats]:
    """Compute D, N and F of every channel.

    Parameters
    ----------
    gathered : Gather
    patches : Patches
    projector_pixels : int
        P.
    form : ndarray, shape (n, n), float32
        G; overwritten.
    albedo : ndarray, shape (n, channels)
    translucent : ndarray of int, shape (m,)
    inside : tuple of ndarray, shape (m, m)
        The dipole per channel; empty where nothing is translucent.
    hidden : int
        The first so many patches are neither lit nor seen, nor translucent.
    progress : callable
        Called with the share done, 0 to 1.

    Returns
    -------
    direct, near : list of scipy.sparse.csr_array, shape (C, P), float32
    far : ndarray, shape (channels, C, P), float32
    """
    lit = np.flatnonzero(patches.pixel >= 0)
    flux = sparse.csr_array(
        (patches.flux[lit].astype(np.float32), (lit, patches.pixel[lit])),
        shape=(len(patches), projector_pixels),
    )
    fall = sparse.csr_array(flux[hidden:].T)
    see = sparse.csr_array(gathered.radiosity[:, hidden:].astype(np.float32))
    channels = albedo.shape[1]
    camera_pixels = see.shape[0]
    direct, near = [], []
    far = np.empty((channels, camera_pixels, projector_pixels), dtype=np.float32)
    for channel in range(channels):
        diffuse = sparse.diags_array(albedo[:, channel] / patches.area)
        shine = sparse.diags_array(1 / patches.area)
        once = gathered.radiosity @ diffuse + gathered.gloss @ shine
        direct.append(sparse.csr_array((once @ flux).astype(np.float32)))
        if inside:
            within = sparse.csr_array(inside[channel])
            light = within @ flux[translucent]
            near.append(
                sparse.csr_array((gathered.radiosity[:, translucent] @ light).astype(np.float32))
            )
        else:
            near.append(sparse.csr_array((camera_pixels, projector_pixels), dtype=np.float32))
        factor = reflection_factor(
            albedo[:, channel], patches, translucent, inside[channel] if inside else None
        )
        last = channel == channels - 1
        rest = bounced(form if last else form.copy(), factor, hidden)
        for rows in blocks(camera_pixels, ROWS_AT_ONCE):
            strip = np.ascontiguousarray((see[rows] @ rest).T)
            far[channel, rows] = (fall @ strip).T
        del rest
        progress((channel + 1) / channels)
    return direct, near, far
