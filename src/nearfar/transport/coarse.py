"""A transport for lights of blocks of projector pixels: quicker to relight, less exact.

Where a light is the same all over each block, far-range light that varies by less than half a
cycle a block, and direct light of footprints that the projector's border does not cut, are exact.
Near-range light is moved by less than a block.

Index convention: j runs over functions of near-range light, m over coefficients of far-range light.
"""

from dataclasses import replace

import numpy as np

from nearfar.arrays import Complexes, Floats, Size
from nearfar.illumination.frequencies import wrap
from nearfar.illumination.near_basis import NearBasis
from nearfar.illumination.real_basis import RealBasis, real_basis
from nearfar.transport.model import Transport


def size_in_blocks(projector: Size, side: int) -> Size:
    """Return rows and columns of blocks of `side` x `side` pixels; the last may be cut."""
    return Size(*(-(-length // side) for length in projector))


def block_means(light: Floats, side: int) -> Floats:
    """Return the means of a light (Py, Px) or (Py, Px, channels) over blocks, float32."""
    if side == 1:
        return light
    for axis, length in enumerate(light.shape[:2]):
        starts = np.arange(0, length, side)
        counts = np.diff(np.append(starts, length)).astype(np.float32)
        means = np.add.reduceat(light, starts, axis=axis, dtype=np.float32)
        light = means / counts.reshape([-1 if i == axis else 1 for i in range(means.ndim)])
    return light


def in_blocks(transport: Transport, side: int) -> Transport:
    """Return a transport for lights of blocks of `side` x `side` projector pixels.

    Parameters
    ----------
    transport : Transport
    side : int
        1, or a power of two below the transport's pitch.

    Returns
    -------
    Transport
        Without error bars, quality and verdict.
    """
    if side == 1:
        return transport
    projector = size_in_blocks(transport.projector, side)
    basis, far = _far_in_blocks(transport, projector, side)
    near_basis = NearBasis(transport.window, transport.pitch // side)
    hats = _to_coarser_hats(transport.near_basis, near_basis, side)
    return replace(
        transport,
        projector=projector,
        correspondence=((transport.correspondence + 0.5) / side - 0.5).astype(np.float32),
        near=transport.near @ hats,
        far=far,
        far_basis=basis,
        pitch=near_basis.pitch,
        footprint=transport.boxes.reshape(*transport.camera, 4) / np.float32(side),
        posterior=None,
        quality=None,
        verdict=None,
    )


def _to_coarser_hats(fine: NearBasis, coarse: NearBasis, side: int) -> Floats:
    """Return coefficients of the coarser basis of those of the finer one, (J, J of it), float32.

    Hats that are finer than a block go to those around them.
    """
    found = np.eye(fine.count, coarse.count, dtype=np.float32)
    place = {
        tuple(offset): j
        for j, (offset, pitch) in enumerate(
            zip(coarse.offsets.tolist(), coarse.pitches.tolist(), strict=True)
        )
        if pitch == 1
    }
    # There is no hat of one block at q itself: its share goes to the four beside it.
    middle = [(-1, 0), (0, -1), (0, 1), (1, 0)]
    for j in range(coarse.count, fine.count):
        towards = np.sign(fine.offsets[j])
        part = np.abs(fine.offsets[j]) / side
        for corner in np.ndindex(2, 2):
            share = float(np.prod(np.where(corner, part, 1 - part)))
            beside = tuple((corner * towards).tolist())
            goals = [beside] if beside in place else middle
            for goal in goals:
                found[j, place[goal]] += share / len(goals)
    return found


def _far_in_blocks(transport: Transport, projector: Size, side: int) -> tuple[RealBasis, Floats]:
    """Return far-range light's basis on blocks, and its responses to it."""
    fine = transport.far_basis
    kept = [
        number
        for number, k in enumerate(fine.frequencies)
        if all(2 * side * abs(part) < 1 for part in k)
    ]
    basis = real_basis(
        [wrap(*(side * part for part in fine.frequencies[number])) for number in kept], projector
    )
    # exp(2 pi i k.p), summed over the pixels of a block, from its first pixel on.
    steps = np.arange(side)
    sums: Complexes = np.prod(
        np.exp(2j * np.pi * fine.cycles[kept][..., None] * steps).sum(axis=-1), axis=-1
    )
    scale = projector.pixels / fine.projector.pixels
    chosen = fine.response_indices([fine.frequencies[number] for number in kept])
    responses = transport.far[..., chosen]
    far = np.empty_like(responses)
    for number, total in enumerate(sums * scale):
        cosine, *sine = np.flatnonzero(basis.index == number)
        if not sine:
            far[..., cosine] = responses[..., cosine] * total.real
            continue
        b = (responses[..., cosine] - 1j * responses[..., sine[0]]) * total
        far[..., cosine], far[..., sine[0]] = b.real, -b.imag
    return basis, far
