"""Dense T from complete sets of patterns."""

import numpy as np
import pytest

from nearfar.arrays import Size
from nearfar.errors import InputError
from nearfar.workflow.complete_sets import write_complete
from tests.cli.conftest import check_done, check_sentence, run_nearfar
from tests.shown import (
    captured,
    cornell,
    hadamard,
    random_binary,
    single_pixels,
    white_and_black,
)

SIZE = Size(8, 8)
CAMERA = Size(9, 7)
BLACK = [np.zeros(SIZE, np.uint8)]


@pytest.fixture(scope="module")
def world():
    return cornell(SIZE, CAMERA)


def _truth(world):
    return np.moveaxis(world.rows(slice(None)).reshape(CAMERA.pixels, -1, SIZE.pixels), 1, 2)


SETS = {
    "one light at a time": lambda: [*single_pixels(SIZE), *white_and_black(SIZE)],
    "Hadamard": lambda: [*hadamard(SIZE), *BLACK],
    "random, twice as many as pixels": lambda: [*random_binary(SIZE, 128), *white_and_black(SIZE)],
}


@pytest.mark.parametrize("name", SETS)
def test_a_complete_set_gives_t_exactly_without_noise(world, name, tmp_path):
    capture = captured(world, SETS[name](), tmp_path, noise=False)
    written = write_complete(capture, tmp_path / "T.npy")
    found = np.load(tmp_path / "T.npy").reshape(CAMERA.pixels, SIZE.pixels, -1)
    truth = _truth(world)
    assert written.shape == np.load(tmp_path / "T.npy").shape == (*CAMERA, *SIZE, 3)
    assert written.has_black
    # Photos of 16 bits.
    np.testing.assert_allclose(found, truth, atol=6e-5 * max(1.0, written.noise_gain))


def test_the_noise_gain_is_that_of_the_entries(world, tmp_path):
    gains = []
    for name in ("one light at a time", "Hadamard"):
        folder = tmp_path / name
        capture = captured(world, SETS[name](), folder)
        written = write_complete(capture, folder / "T.npy")
        off = np.load(folder / "T.npy").reshape(CAMERA.pixels, SIZE.pixels, -1) - _truth(world)
        read_noise = np.hypot(4 / 30_000, 12**-0.5 / 16383)
        assert off.std() > 0.9 * written.noise_gain * read_noise
        gains.append(written.noise_gain)
    # Half the pixels are lit in each Hadamard pattern, so that every photo tells of every pixel.
    assert gains[1] < 2.5 / np.sqrt(SIZE.pixels) < 0.9 < gains[0] < 1.5


def test_patterns_of_blocks_are_solved_on_their_own_grid(world, tmp_path):
    pictures = SETS["one light at a time"]()
    shown = [np.kron(picture, np.ones((3, 5), np.uint8)) for picture in pictures]
    capture = captured(world, pictures, tmp_path, shown=shown, noise=False)
    assert capture.plan.projector == Size(24, 40)
    written = write_complete(capture, tmp_path / "T.npy")
    assert written.grid == SIZE
    found = np.load(tmp_path / "T.npy").reshape(CAMERA.pixels, SIZE.pixels, -1)
    np.testing.assert_allclose(found, _truth(world), atol=1e-4)


@pytest.mark.parametrize(
    ("pictures", "words"),
    [
        (random_binary(SIZE, 40), "is not complete"),
        ([*hadamard(SIZE)[:-1], hadamard(SIZE)[5], *BLACK], "do not tell all pixels"),
    ],
)
def test_sets_that_are_not_complete_are_refused(world, pictures, words, tmp_path):
    capture = captured(world, pictures, tmp_path, noise=False)
    with pytest.raises(InputError, match=words):
        write_complete(capture, tmp_path / "T.npy")
    assert not (tmp_path / "T.npy").exists()


def test_the_command_line_writes_a_t_that_other_commands_take(world, tmp_path):
    captured(world, SETS["one light at a time"](), tmp_path / "a", noise=False)
    said = check_done(run_nearfar("reconstruct", tmp_path / "a" / "c.zarr", tmp_path / "T.npy"))
    assert "T of 9 x 7 x 8 x 8 x 3 written to" in said.out
    check_done(run_nearfar("info", tmp_path / "T.npy"))
    check = run_nearfar("check", tmp_path / "T.npy", "--near", "3", "--far", "3x3")
    assert check.status == 0
    again = run_nearfar("reconstruct", tmp_path / "a" / "c.zarr", tmp_path / "T.npy")
    assert "exists already" in check_sentence(again)
    captured(world, single_pixels(SIZE), tmp_path / "b", noise=False)
    ran = run_nearfar("reconstruct", tmp_path / "b" / "c.zarr", tmp_path / "U.npy")
    assert ran.status == 0
    assert "black was taken as 0" in ran.err
