"""Frames of a projector of known response: light linear in the levels, to a step of a block."""

import numpy as np
import pytest

from nearfar.arrays import Size
from nearfar.errors import InputError
from nearfar.illumination.frames import draw_frame, fit_frame
from nearfar.rigs.linear import LinearProjector, identity

GAMMAS = (1.8, 2.2, 2.6)


def _response():
    """Three primaries of different gammas."""
    return np.stack([(np.arange(256) / 255) ** gamma for gamma in GAMMAS], axis=-1)


def _light(frame, grid, scale, response):
    """Mean light of each block, (Py, Px, 3)."""
    top, left = ((a - scale * b) // 2 for a, b in zip(frame.shape, grid, strict=False))
    inside = frame[top : top + scale * grid[0], left : left + scale * grid[1]]
    shone = np.stack([response[inside[..., i], i] for i in range(3)], axis=-1)
    return shone.reshape(grid[0], scale, grid[1], scale, 3).mean(axis=(1, 3))


@pytest.mark.parametrize("scale", [1, 2, 5, 11])
@pytest.mark.parametrize("brightness", [1.0, 0.6])
def test_the_light_of_a_block_is_linear_in_its_level(scale, brightness):
    grid = Size(16, 16)
    pattern = np.arange(256, dtype=np.uint8).reshape(grid)
    response = _response()
    shown = fit_frame(grid, scale, Size(16 * scale + 3, 16 * scale + 8))
    light = _light(
        LinearProjector(response, shown, brightness).draw(pattern), grid, scale, response
    )
    error = np.abs(light - brightness * pattern[..., np.newaxis] / 255)
    # Half a step between levels, of which a block shows a share.
    assert error.max() <= 0.5 * np.diff(response, axis=0).max() / scale**2 + 1e-6
    assert light[0, 0].max() == 0
    assert light[-1, -1] == pytest.approx(np.full(3, brightness), abs=2e-2 / scale)


def test_a_linear_projector_gets_the_pattern_as_it_is():
    grid = Size(16, 16)
    pattern = np.random.default_rng(0).permutation(256).astype(np.uint8).reshape(grid)
    shown = fit_frame(grid, None, Size(50, 70))
    frame = LinearProjector(identity(), shown).draw(pattern)
    for primary in range(3):
        np.testing.assert_array_equal(frame[..., primary], draw_frame(pattern, shown))


def test_each_colour_of_a_pattern_is_shown_by_its_primary():
    grid = Size(16, 16)
    pattern = np.random.default_rng(1).integers(0, 256, (*grid, 3), dtype=np.uint8)
    linear = LinearProjector(_response(), fit_frame(grid, 3, Size(50, 70)))
    frame = linear.draw(pattern)
    for primary in range(3):
        alone = linear.draw(pattern[..., primary])[..., primary]
        np.testing.assert_array_equal(frame[..., primary], alone)


def test_a_pair_of_inverses_adds_up_to_white():
    grid, scale = Size(16, 16), 4
    pattern = np.arange(256, dtype=np.uint8).reshape(grid)
    linear = LinearProjector(_response(), fit_frame(grid, scale, None))
    both = sum(_light(linear.draw(p), grid, scale, _response()) for p in (pattern, 255 - pattern))
    assert np.abs(both - 1).max() < 2 * 0.5 * 0.012 / scale**2


@pytest.mark.parametrize("bad", ["shape", "falls", "dark", "bright"])
def test_a_response_that_cannot_be_is_refused(bad):
    response, brightness = _response(), 1.0
    if bad == "shape":
        response = response[:, 0]
    elif bad == "falls":
        response[100] = 0
    else:
        brightness = 0.0 if bad == "dark" else 1.5
    with pytest.raises(InputError):
        LinearProjector(response, fit_frame(Size(2, 2), None, None), brightness)
