"""Places between two surfaces, which light neither and score highest all the same."""

import numpy as np
import pytest

from nearfar.arrays import Size, blocks
from nearfar.correspondence import correspond_by_phase, phase
from nearfar.correspondence.methods import method_named
from nearfar.correspondence.sidelobes import Replaced
from nearfar.illumination.frequencies import CHECKERBOARD, DC, grid, representatives
from nearfar.illumination.real_basis import real_basis
from nearfar.photometry.measurements import Measurements
from nearfar.plan import paper_plan

PROJECTOR = Size(64, 64)
CAMERA = Size(40, 45)
# Few frequencies, most of them on grids whose periods are 8, 9 and 11 pixels.
FEW = [
    *grid(Size(3, 3), Size(8, 8)),
    *grid(Size(3, 3), Size(9, 9)),
    *grid(Size(3, 3), Size(11, 11)),
]
# The camera sees a surface in front, and past it one behind, in columns of this many pixels.
COLUMNS = 5
NOISE = 0.004


def _surfaces(thin):
    """Return q of the surface in front and of that behind, and the share of each in what is seen.

    At the edges between them a camera pixel sees both; `thin` columns of the front one stand alone.
    """
    y, x = np.meshgrid(
        np.linspace(2, 50, CAMERA.height), np.linspace(2, 48, CAMERA.width), indexing="ij"
    )
    behind = np.rint(np.stack([y, x], axis=-1))
    front = np.rint(np.stack([y + 9, x + 13], axis=-1))
    column = np.arange(CAMERA.width)
    if thin:
        share = np.where(column % COLUMNS == 2, 1.0, 0.0)
    else:
        share = np.where(column // COLUMNS % 2 == 1, 1.0, 0.0)
        share[COLUMNS::COLUMNS] = 0.5
    return front, behind, np.broadcast_to(share, CAMERA)


def _measured(thin=False, seed=0):
    """Return q of both surfaces, how much each camera pixel sees of the front, and responses."""
    front, behind, share = _surfaces(thin)
    basis = real_basis(representatives([DC, *FEW, CHECKERBOARD]), PROJECTOR)
    generator = np.random.default_rng(seed)
    responses = sum(
        0.6 * part.reshape(-1, 1) * basis.patterns_at(q.reshape(-1, 2)).T
        for part, q in ((share, front), (1 - share, behind))
    )
    responses = responses + NOISE * generator.normal(size=responses.shape)
    level = np.full((CAMERA.pixels, 1), NOISE, dtype=np.float32)
    measurements = Measurements(
        camera=CAMERA,
        basis=basis,
        responses=responses[:, None].astype(np.float32),
        noise=level,
        black=np.zeros_like(level),
        quantisation_error=np.zeros_like(basis.patterns),
    )
    return front, behind, share, measurements


def _is_false(found, front, behind):
    """Return which q is far from both surfaces."""
    return np.minimum(*(np.abs(found.q - q).max(axis=-1) for q in (front, behind))) > 3


def _by_each_alone(monkeypatch, measurements):
    """Find q without neighbours."""
    nothing = Replaced(np.arange(0), np.empty((0, 2)))
    with monkeypatch.context() as changed:
        changed.setattr(phase, "replace_sidelobes", lambda *_: nothing)
        return correspond_by_phase(measurements, pitch=1)


@pytest.mark.parametrize("seed", [0, 1])
def test_camera_pixels_that_see_two_surfaces_get_one_of_them(monkeypatch, seed):
    front, behind, share, measurements = _measured(seed=seed)
    edges = share == 0.5
    alone = _by_each_alone(monkeypatch, measurements)
    assert np.mean(_is_false(alone, front, behind)[edges]) > 0.9
    found = correspond_by_phase(measurements, pitch=1)
    assert found.lit.all()
    assert not _is_false(found, front, behind).any()
    np.testing.assert_array_equal(found.q[~edges], alone.q[~edges])


def test_thin_things_and_edges_stay_where_they_are(monkeypatch):
    """Single columns, with which no neighbour agrees to the left and to the right."""
    front, behind, share, measurements = _measured(thin=True)
    found = correspond_by_phase(measurements, pitch=1)
    q = np.where(share[..., None] > 0.5, front, behind)
    assert np.abs(found.q - q).max() < 0.5
    np.testing.assert_array_equal(found.q, _by_each_alone(monkeypatch, measurements).q)


def test_tiles_of_rows_are_those_of_the_whole():
    *_, measurements = _measured()
    whole = correspond_by_phase(measurements, pitch=1)
    plan = paper_plan(PROJECTOR, 5, Size(5, 5), correspondence="phase")
    beside = method_named("phase").rows_needed(plan)
    for tile in blocks(CAMERA.height, 6):
        first, last = max(0, tile.start - beside), min(CAMERA.height, tile.stop + beside)
        part = measurements.of_pixels(
            Size(last - first, CAMERA.width), slice(first * CAMERA.width, last * CAMERA.width)
        )
        found = correspond_by_phase(part, pitch=1)
        rows = slice(tile.start - first, tile.stop - first)
        np.testing.assert_allclose(found.q[rows], whole.q[tile], atol=1e-4)
        np.testing.assert_allclose(found.confidence[rows], whole.confidence[tile], atol=1e-4)
