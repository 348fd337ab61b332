"""From the rows of the last turn to a transport.

Index convention: arrays are (C, channels, ...); w runs over window entries.
"""

import numpy as np

from nearfar.arrays import Floats, Size, beside, blocks, fetch, namespace, product
from nearfar.estimate.joint.pixels import (
    dc_place,
)
from nearfar.estimate.joint.positive import raise_to
from nearfar.estimate.joint.problem import Problem, Rows
from nearfar.estimate.matrices import Band, band_of
from nearfar.illumination.frequencies import DC, far_frequencies
from nearfar.illumination.real_basis import real_basis
from nearfar.parallel import side_by_side
from nearfar.photometry.measurements import Measurements
from nearfar.transport import near
from nearfar.transport.kinds import LIT, UNLIT
from nearfar.transport.model import Transport
from nearfar.transport.posterior import Posterior

# Camera pixels at once.
BLOCK = 2048


def assemble(problem: Problem, rows: Rows, far: Size) -> Transport:
    """Put the factors together: f at the far band's frequencies, its DC what d and n leave."""
    measurements, band, whole = problem.measurements, problem.model.band, problem.whole
    wanted = set(far_frequencies(far, measurements.projector))
    low = [k for k in band.basis.frequencies if k in wanted or -k in wanted]
    basis = real_basis([DC, *low], measurements.projector)
    kept = np.flatnonzero(np.isin(band.basis.index, [band.basis.frequencies.index(k) for k in low]))
    share_of_white = _share_of_white(measurements).astype(np.float32)
    xp = namespace(rows.near)
    white, share, places = (
        beside(values, rows.near)
        for values in (measurements.responses[..., dc_place(measurements)], share_of_white, kept)
    )
    direct = xp.clip(rows.shared[..., 1], min=0.0) * whole.lit[:, None]
    rest = white - share * rows.shared[..., 0] - direct - xp.sum(rows.near, axis=-1)
    far_range = xp.concat([rest[..., None], rows.far[..., places]], axis=-1)
    drawn = band_of(basis, near.offsets(problem.window)).put(lambda one: beside(one, rows.near))
    windows = _positive(problem, rows.near, far_range, drawn)
    shape = (*measurements.camera, measurements.channels)
    # What differs from the neighbours' mean is weak because a camera pixel's own photos are in
    # that mean: the first turn's kind and strength tell the error (docs/decisions/0011).
    first = rows.choices[0]
    return Transport(
        projector=measurements.projector,
        correspondence=fetch(whole.correspondence)
        .reshape(*measurements.camera, 2)
        .astype(np.float32),
        direct=fetch(direct).reshape(shape),
        near=fetch(windows).reshape(*shape, problem.window, problem.window),
        far=fetch(far_range).reshape(*shape, -1),
        far_basis=basis,
        black=measurements.black.reshape(shape),
        noise=measurements.noise.reshape(shape),
        posterior=Posterior(
            kinds=(*LIT, *UNLIT),
            frequencies=band.basis.frequencies,
            multiplicity=fetch(problem.model.multiplicity),
            kind=fetch(first.kind).astype(np.uint8).reshape(measurements.camera),
            strength=fetch(first.strength).reshape(measurements.camera),
            white=fetch(whole.white).reshape(shape),
            offset_noise=fetch(whole.offset_noise).reshape(shape),
            light_noise=measurements.light_noise.reshape(shape),
            share_of_white=share_of_white.reshape(shape),
        ),
    )


def _positive(problem: Problem, windows: Floats, far_range: Floats, band: Band) -> Floats:
    """Raise window entries to where n and f together are not negative, white kept."""
    apart = np.abs(near.offsets(problem.window)).max(axis=1) > 1
    inside = near.inside(problem.whole.centres, problem.window, problem.measurements.projector)
    xp = namespace(windows)
    free = inside & beside(apart, windows) & problem.whole.lit[:, None]
    found: Floats = xp.empty_like(windows)
    weights = beside(band.basis.weights.astype(np.float32), windows)

    def work(block: slice) -> None:
        turned = band.recentre(far_range[block] * weights, problem.whole.centres[block])
        least = -product(turned, band.on_window)
        mine = xp.broadcast_to(free[block, None], least.shape)
        found[block] = raise_to(windows[block], least, mine)

    side_by_side(work, blocks(len(windows), BLOCK))
    return found


def _share_of_white(measurements: Measurements) -> Floats:
    """How much of the references' error o is, on average, white's own error.

    o = -(e_w + e_k) and white's is e_w - e_k for errors e_w of white and e_k of black.
    """
    white, black = measurements.white_noise**2, measurements.black_noise**2
    return np.asarray((black - white) / np.maximum(white + black, np.finfo(np.float32).tiny))
