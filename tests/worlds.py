"""Transports that obey the model exactly, and photos in memory."""

import numpy as np

from nearfar.arrays import Size
from nearfar.illumination.frequencies import DC, far_frequencies, representatives
from nearfar.illumination.near_basis import window_offsets
from nearfar.illumination.real_basis import real_basis
from nearfar.photometry.measurements import Measurements
from nearfar.photometry.theory import measure_in_theory
from nearfar.plan import paper_plan
from nearfar.transport import near
from nearfar.transport.model import Transport


def model_transport(
    projector: Size,
    camera: Size,
    *,
    window: int,
    far: Size,
    channels: int = 1,
    seed: int = 0,
    fractional: bool = False,
    entries: int = 5,
) -> Transport:
    """Draw a transport that obeys the model.

    n is sparse in its window and has no answer to the checkerboard, f is band-limited, and no
    picture under a light in [0, 1] leaves [0, 1].
    """
    generator = np.random.default_rng(seed)
    pixels = camera.pixels
    y, x = np.meshgrid(
        np.linspace(0, projector.height - 1, camera.height),
        np.linspace(0, projector.width - 1, camera.width),
        indexing="ij",
    )
    q = np.stack([y, x], axis=-1)
    if not fractional:
        q = np.rint(q)
    shape = (*camera, channels)
    windows = np.zeros((pixels, channels, window**2))
    inside = near.inside(near.centre(q, projector), window, projector)
    parity = 1 - 2 * (window_offsets(window).sum(axis=1) % 2)
    for c in range(pixels):
        for i in range(channels):
            # One more entry of the other parity silences the checkerboard.
            even = np.flatnonzero(inside[c] & (parity > 0))
            odd = np.flatnonzero(inside[c] & (parity < 0))
            chosen = generator.choice(even, size=min(entries, len(even)), replace=False)
            windows[c, i, chosen] = generator.uniform(0.005, 0.02, size=len(chosen))
            windows[c, i, generator.choice(odd)] = windows[c, i].sum()
    basis = real_basis(representatives(far_frequencies(far, projector)), projector)
    coefficients = 0.01 * generator.normal(size=(*shape, basis.count))
    coefficients[..., [basis.frequencies[i] == DC for i in basis.index]] = 0.2
    return Transport(
        projector=projector,
        correspondence=q.astype(np.float32),
        direct=generator.uniform(0.1, 0.4, size=shape).astype(np.float32),
        near=windows.reshape(*shape, window, window).astype(np.float32),
        far=coefficients.astype(np.float32),
        far_basis=basis,
        black=np.zeros(shape, dtype=np.float32),
        noise=np.zeros(shape, dtype=np.float32),
    )


def ideal_measurements(transport: Transport, window: int, far: Size, dropped: Size) -> Measurements:
    """Measure by theory: no offset, no noise, no 8 bits."""
    plan = paper_plan(
        transport.projector, window, far, dropped=dropped, offset="none", correspondence="none"
    )
    return measure_in_theory(plan, transport)
