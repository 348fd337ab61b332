"""Assemble a transport from the estimated rows of the last sweep.

Index convention: arrays are (C, channels, ...); w runs over window entries.
"""

import numpy as np
from array_api_compat import device

from nearfar.arrays import Floats, Integers, Size, beside, fetch, namespace
from nearfar.estimate.joint.batch import dc_index
from nearfar.estimate.joint.positive import make_positive
from nearfar.estimate.joint.problem import EstimatedRows, Problem
from nearfar.estimate.joint.second_places import SecondPlaces
from nearfar.estimate.joint.shares import share_on_projector
from nearfar.estimate.joint.spikes import around_q
from nearfar.illumination.centred_basis import centred_basis
from nearfar.illumination.frequencies import DC, far_frequencies, is_on_grid
from nearfar.illumination.real_basis import real_basis
from nearfar.parallel import in_batches
from nearfar.photometry.measurements import Measurements
from nearfar.priors.fitted import LIT_COMPONENTS, UNLIT_COMPONENTS
from nearfar.transport.boxes import share_of_boxes
from nearfar.transport.direct import direct_weights
from nearfar.transport.model import Transport
from nearfar.transport.posterior import Posterior

# Camera pixels of a batch.
BATCH_PIXELS = 2048
# Of the noise that neighbours take off, error bars leave out this share: what the filter blurs is
# an error too.
LEFT_OUT_SHARE = 0.5


def assemble(
    problem: Problem,
    rows: EstimatedRows,
    far: Size,
    unexplained: Floats,
    second: SecondPlaces | None = None,
) -> Transport:
    """Return the transport, which at a pitch over 1 takes over the arrays of the rows.

    `unexplained` (C, channels) is the share of the posterior's variance that `with_remainder`
    leaves.

    f is kept at the measured frequencies of the far band, and at those others that lie on the DFT
    grid of the projector: there light is held that no window holds. Its DC is white less d and n.
    """
    measurements, centred, pixels = problem.measurements, problem.model.centred, problem.pixels
    wanted = set(far_frequencies(far, measurements.projector))
    measured = centred.basis
    low = [
        k
        for k in measured.frequencies
        if k in wanted or -k in wanted or is_on_grid(k, measurements.projector)
    ]
    basis = real_basis([DC, *low], measurements.projector)
    number = {k: i for i, k in enumerate(measured.frequencies)}
    kept = np.flatnonzero(np.isin(measured.index, [number[k] for k in low]))
    share_of_white = _share_of_white(measurements).astype(np.float32)
    white, share, far_indices = (
        beside(values, rows.near)
        for values in (measurements.responses[..., dc_index(measurements)], share_of_white, kept)
    )
    rows = _without_negative_direct(problem, rows)
    direct = rows.amplitudes[..., 1] * pixels.lit[:, None]
    rest = white - share * rows.amplitudes[..., 0] - _under_white(problem, direct, rows.near)
    if second is not None and len(second.pixels):
        rest[beside(second.pixels, rest)] -= beside(second.direct, rest)
    far_range = _far_range(rest, rows.far, far_indices)
    of_far = centred_basis(basis, problem.near_basis)
    of_far = of_far.put(lambda one: beside(one, rows.near))
    # Later sweeps estimate small differences from a mean that a camera pixel's own photos are part
    # of: prior component and scale by the first sweep's evidence fit the error (docs/decisions/0011
    # and 0061).
    of_error_bars = rows.choices.of_error_bars
    assert of_error_bars is not None
    windows = rows.near
    if problem.near_basis.pitch == 1:
        windows, far_range = make_positive(
            problem, rows.near, far_range, of_far, kept, of_error_bars
        )
    shape = (*measurements.camera, measurements.channels)
    footprint = None
    if problem.near_basis.pitch > 1:
        footprint = fetch(pixels.footprint).reshape(*measurements.camera, 4)
    place, direct_there = _of_camera(second, measurements)
    return Transport(
        projector=measurements.projector,
        correspondence=fetch(pixels.correspondence)
        .reshape(*measurements.camera, 2)
        .astype(np.float32),
        direct=fetch(direct).reshape(shape),
        near=fetch(windows).reshape(*shape, *problem.near_basis.shape),
        far=fetch(far_range).reshape(*shape, -1),
        far_basis=basis,
        pitch=problem.near_basis.pitch,
        footprint=footprint,
        second_place=place,
        second_direct=direct_there,
        black=measurements.black.reshape(shape),
        noise=measurements.noise.reshape(shape),
        posterior=Posterior(
            prior_components=(*LIT_COMPONENTS, *UNLIT_COMPONENTS),
            frequencies=measured.frequencies,
            multiplicity=fetch(problem.model.multiplicity),
            prior_component=fetch(of_error_bars.prior_component)
            .astype(np.uint8)
            .reshape(measurements.camera),
            prior_scale=fetch(of_error_bars.prior_scale).reshape(measurements.camera),
            white=fetch(pixels.white).reshape(shape),
            offset_noise=fetch(pixels.offset_noise).reshape(shape),
            light_noise=measurements.light_noise.reshape(shape),
            share_of_white=share_of_white.reshape(shape),
            noise_share=fetch(
                unexplained * (1.0 - LEFT_OUT_SHARE * (1.0 - rows.noise_left))
            ).reshape(shape),
        ),
    )


def _of_camera(
    second: SecondPlaces | None, measurements: Measurements
) -> tuple[Floats | None, Floats | None]:
    """Return second places and their direct light as a transport has them."""
    if second is None:
        return None, None
    camera, channels = measurements.camera, measurements.channels
    places = np.full((camera.pixels, 2), np.nan, dtype=np.float32)
    direct = np.zeros((camera.pixels, channels), dtype=np.float32)
    places[second.pixels], direct[second.pixels] = second.places, second.direct
    return places.reshape(*camera, 2), direct.reshape(*camera, channels)


def _far_range(rest: Floats, far: Floats, kept: Integers) -> Floats:
    """Return white's far-range light, (C, channels), and kept responses of f, in one array."""
    xp = namespace(far)
    found: Floats = xp.empty((*rest.shape, 1 + len(kept)), dtype=far.dtype, device=device(far))
    here = beside(kept, far)

    def work(batch: slice) -> None:
        found[batch, :, 0] = rest[batch]
        found[batch, :, 1:] = xp.take(far[batch], here, axis=2)

    in_batches(work, len(far), BATCH_PIXELS, far)
    return found


def _under_white(problem: Problem, direct: Floats, coefficients: Floats) -> Floats:
    """Return direct and near-range light under white, (C, channels)."""
    xp, near_basis, pixels = namespace(coefficients), problem.near_basis, problem.pixels
    if near_basis.pitch == 1:
        whole: Floats = direct + xp.sum(coefficients, axis=-1)
        return whole
    projector = problem.measurements.projector
    found = np.asarray(coefficients.sum(axis=-1))
    # Hats about other q lie on the projector.
    from_border = np.minimum(pixels.centres, np.array(projector) - 1 - pixels.centres)
    (cut,) = np.nonzero(from_border.min(axis=1) < near_basis.reach)
    hats = near_basis.offsets, near_basis.pitches
    shares = share_on_projector(pixels.centres[cut], *hats, projector)
    found[cut] = np.einsum("cij,cj->ci", coefficients[cut], shares)
    of_direct = share_of_boxes(pixels.correspondence, pixels.footprint, projector)
    return np.asarray(direct * of_direct[:, None] + found)


def _without_negative_direct(problem: Problem, rows: EstimatedRows) -> EstimatedRows:
    """Raise d to 0 where it is negative, and lower the window's entries at q by as much light."""
    xp, window = namespace(rows.near), problem.near_basis.window
    negative = xp.clip(rows.amplitudes[..., 1], max=0.0) * problem.pixels.lit[:, None]
    amplitudes = xp.asarray(rows.amplitudes, copy=True)
    amplitudes[..., 1] -= negative
    around = around_q(window)
    if not len(around):
        return rows._replace(amplitudes=amplitudes)
    if problem.near_basis.pitch > 1:
        rows.near[..., window**2 // 2] += negative
        return rows._replace(amplitudes=amplitudes)
    windows = xp.asarray(rows.near, copy=True)
    weights = direct_weights(problem.pixels.correspondence, problem.pixels.centres)[:, 0]
    windows[..., beside(around, windows)] += negative[..., None] * weights[:, None]
    return rows._replace(amplitudes=amplitudes, near=windows)


def _share_of_white(measurements: Measurements) -> Floats:
    """Return the mean share of the references' error o that is white's own error.

    o = -(e_w + e_k) and white's is e_w - e_k for errors e_w of white and e_k of black.
    """
    white, black = measurements.white_noise**2, measurements.black_noise**2
    return np.asarray((black - white) / np.maximum(white + black, np.finfo(np.float32).tiny))
