"""T @ l against Mitsuba's own pictures, to their noise."""

import numpy as np
import pytest

from nearfar.arrays import Size
from nearfar.errors import InputError
from nearfar.scenes.mitsuba.loading import load_scene
from nearfar.scenes.mitsuba.photos import RenderedWorld
from nearfar.scenes.mitsuba.transport import render_transport
from tests.scenes.mitsuba import descriptions as d

GRID = Size(8, 10)
RUNS = 16
SAMPLES = 256
SCENES = {
    "diffuse": d.scene(method=d.integrator("path", 2)),
    "three vertices": d.scene(d.ball(0.4, 0, 0, ""), method=d.integrator("path", 3)),
    "roulette": d.scene(d.LAMP, method=d.integrator("path", -1, 2)),
    "glossy": d.scene(d.GLOSSY + d.panel(d.MASK)),
    "glossy, null boundaries": d.scene(
        d.GLOSSY + d.panel(d.MASK), method=d.integrator("volpath", 5)
    ),
    "even medium": d.scene(d.EVEN + d.panel(d.MASK), method=d.integrator("volpath", 8)),
    "even medium in mis": d.scene(d.EVEN, method=d.integrator("volpathmis", 4, 3)),
    "uneven medium": d.scene(d.LAMP + d.GRID, method=d.integrator("volpath", 6)),
}


def _lights() -> np.ndarray:
    generator = np.random.default_rng(1)
    corner = np.zeros(GRID)
    corner[1:4, 5:9] = 1
    return np.stack([np.zeros(GRID), np.ones(GRID), corner, generator.uniform(size=GRID)])


def _regions(pictures: np.ndarray) -> np.ndarray:
    """Means over 4 x 4 regions of pictures (runs, lights, 16, 16, 3), and over channels."""
    return pictures.reshape(*pictures.shape[:2], 4, 4, 4, 4, 3).mean(axis=(3, 5, 6))


@pytest.mark.slow
@pytest.mark.parametrize("name", SCENES)
def test_transport_gives_mitsubas_pictures(write, name: str):
    loaded = load_scene(write(SCENES[name]), GRID)
    lights = _lights()
    world = RenderedWorld(loaded, SAMPLES)
    photos = np.stack([world.pictures(lights) for _ in range(RUNS)]).astype(np.float64)
    relit = np.stack(
        [render_transport(loaded, SAMPLES, seed).pictures(lights[1:]) for seed in range(RUNS)]
    ).astype(np.float64)
    photos = photos[:, 1:] - photos[:, :1]
    # Region by region, the means of both differ by no more than their own scatter tells. z follows
    # Student's t with 30 degrees of freedom: z^2 has the mean 1.07 and the deviation 1.5. The
    # lights share T and the regions paths, so some 32 of the values are independent, and three
    # deviations above the mean are 1.07 + 3 * 1.5 / sqrt(32) = 1.37^2.
    ours, stock = _regions(relit), _regions(photos)
    error = np.sqrt((ours.var(axis=0, ddof=1) + stock.var(axis=0, ddof=1)) / RUNS)
    lit = stock.mean(axis=0) > 1e-3
    z = ((ours - stock).mean(axis=0) / np.maximum(error, 1e-9))[lit]
    assert np.sqrt(np.mean(z**2)) < 1.37
    # All the light of a picture has far less noise: four standard errors, at most 5 %.
    for i in range(len(lights) - 1):
        sums, known = relit[:, i].sum(axis=(1, 2, 3)), photos[:, i].sum(axis=(1, 2, 3))
        noise = np.sqrt((sums.var(ddof=1) + known.var(ddof=1)) / RUNS) / known.mean()
        assert abs(sums.mean() / known.mean() - 1) < 4 * noise < 0.05


def test_each_projector_pixel_is_its_own_column(write):
    """One column at a time, the pattern's pixel [y, x] is the projector's, and so is T's."""
    loaded = load_scene(write(d.scene(method=d.integrator("path", 2))), Size(3, 4))
    transport = render_transport(loaded, 2048)
    lights = np.eye(12).reshape(12, 3, 4)
    photos = RenderedWorld(loaded, 2048).pictures(lights)
    relit = transport.pictures(lights)
    for i in range(12):
        scale = photos[i].max()
        assert scale > 0
        # Where the picture is brightest tells one column from its neighbours.
        assert np.abs(photos[i] - relit[i]).mean() < 0.05 * np.abs(photos[i]).mean() + 1e-4
    # Row 0 of the pattern lights the top of the photo, column 0 its left.
    y, x = np.mgrid[:16, :16]
    centres = [(np.average(y, weights=p.sum(-1)), np.average(x, weights=p.sum(-1))) for p in photos]
    assert centres[0][0] < centres[8][0] - 3
    assert centres[0][1] < centres[3][1] - 3


def test_a_seed_is_a_transport(write):
    loaded = load_scene(write(d.scene()), Size(4, 4), Size(4, 4))
    first, again, other = (render_transport(loaded, 64, seed).far for seed in (1, 1, 2))
    np.testing.assert_allclose(first, again, rtol=1e-5, atol=1e-7)
    assert np.abs(first - other).max() > 1e-3
    assert not np.isnan(first).any()
    assert (first >= 0).all()


def test_blocks_and_passes_change_nothing_but_noise(write, monkeypatch: pytest.MonkeyPatch):
    from nearfar.scenes.mitsuba import transport

    loaded = load_scene(write(d.scene(method=d.integrator("path", 2))), Size(4, 4), Size(8, 8))
    whole = render_transport(loaded, 2048).far
    shares = []
    monkeypatch.setattr(transport, "BLOCK_BYTES", 16 * 3 * 8 * 24)
    monkeypatch.setattr(transport, "SAMPLES_AT_ONCE", 24 * 600)
    cut = render_transport(loaded, 2048, progress=lambda _, share: shares.append(share)).far
    assert len(shares) == 4 + 4 + 3
    assert shares == sorted(shares)
    assert shares[-1] == 1
    assert np.abs(whole - cut).mean() < 0.1 * whole.mean()
    assert cut.sum() == pytest.approx(whole.sum(), rel=0.02)


def test_a_grey_film_has_one_channel(write):
    method = d.integrator("path", 2)
    colour = load_scene(write(d.scene(method=method)), GRID)
    grey = load_scene(write(d.scene(method=method, pixels="luminance")), GRID)
    photo = RenderedWorld(grey, 256).pictures(np.ones((1, *GRID)))
    relit = render_transport(grey, 256)
    assert photo.shape == (1, 16, 16, 1)
    assert relit.channels == 1
    assert relit.far.sum() == pytest.approx(photo.sum(), rel=0.02)
    assert relit.far.sum() < render_transport(colour, 256).far[0].sum()


def test_paths_that_cannot_be_followed_are_refused(write):
    loaded = load_scene(write(d.scene(method=d.integrator("ptracer"))), GRID)
    with pytest.raises(InputError, match=r"ptracer.*: use one of path"):
        render_transport(loaded, 4)
    # Its pictures are another matter.
    assert RenderedWorld(loaded, 4).pictures(np.ones((1, *GRID))).max() > 0
    with pytest.raises(InputError, match="at least 1"):
        render_transport(load_scene(write(d.scene()), GRID), 0)
