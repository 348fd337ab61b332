"""Reference acquisitions: exact without noise, as noisy as theory says, in little memory."""

import itertools
import tracemalloc

import numpy as np
import pytest

from nearfar.arrays import Size
from nearfar.baselines.brute_force import BruteForce
from nearfar.baselines.hadamard import Hadamard
from nearfar.baselines.reference import acquire_reference
from nearfar.errors import InputError, StorageError
from nearfar.rigs.simulated.camera import SimulatedCamera
from nearfar.rigs.simulated.projector import SimulatedProjector
from nearfar.rigs.simulated.rig import SimulatedRig
from nearfar.transport.exact import ExactTransport
from nearfar.transport.exact_store import load_exact, save_exact
from tests.baselines.full_dft import FullDFT
from tests.conftest import QUIET

ACQUISITIONS = (BruteForce, FullDFT, Hadamard)
SIZES = (Size(5, 7), Size(1, 1), Size(8, 8), Size(3, 4), Size(1, 9), Size(6, 1), Size(2, 2))
# Photos are rounded to 16 bits; an entry is made of two or more of them.
ROUNDING = 3e-5


def _world(projector, camera=Size(3, 4), channels=2, seed=0):
    """No picture under a light in [0, 1] is above 0.6."""
    generator = np.random.default_rng(seed)
    far = generator.random((channels, camera.pixels, projector.pixels), dtype=np.float32)
    far *= np.float32(0.6) / far.sum(axis=2, keepdims=True)
    return ExactTransport(projector, camera, (), (), far)


def _rig(world, camera=QUIET, black_level=0.0, seed=0):
    optics = SimulatedProjector(black_level=black_level)
    return SimulatedRig(world, "test", optics, camera, 1.0, seed)


@pytest.mark.parametrize("size", SIZES, ids=str)
@pytest.mark.parametrize("kind", ACQUISITIONS)
def test_transport_is_exact_under_ambient_light_and_black_levels(kind, size):
    world = _world(size)
    camera = QUIET.model_copy(update={"ambient": 0.1, "black_level": 0.05})
    found = acquire_reference(kind(size), _rig(world, camera, black_level=0.1))
    assert (found.projector, found.camera, found.is_apart) == (size, world.camera, False)
    assert np.abs(found.far - world.far).max() < ROUNDING


@pytest.mark.parametrize("size", SIZES, ids=str)
@pytest.mark.parametrize("kind", ACQUISITIONS)
def test_photos_are_counted(kind, size):
    acquisition = kind(size)
    drawn = list(acquisition.patterns())
    assert len(drawn) == acquisition.photos
    assert {(p.shape, p.dtype) for p in drawn} == {(tuple(size), np.dtype(np.uint8))}


def test_counts_are_those_of_theory():
    size = Size(5, 7)
    assert BruteForce(size).photos == 36
    assert FullDFT(size).photos == 70
    # 35 to 42 hold 37 and 41, which are 1 mod 4.
    assert Hadamard(size).order == 43
    for pixels, order in ((1, 3), (3, 3), (4, 7), (9, 11), (6800, 6803)):
        assert Hadamard(Size(1, pixels)).order == order


@pytest.mark.parametrize("pixels", [3, 7, 11, 19, 40])
def test_the_s_matrix_is_one(pixels):
    hadamard = Hadamard(Size(1, pixels))
    q = hadamard.order
    m = np.arange(q)
    s = hadamard.sequence.astype(int)[(m[:, None] + m) % q]
    assert np.array_equal(s @ s.T, (q + 1) // 4 * (np.eye(q, dtype=int) + 1))


def test_patterns_come_one_at_a_time():
    for kind in ACQUISITIONS:
        first = next(iter(kind(Size(64, 64)).patterns()))
        assert first.shape == (64, 64)


@pytest.mark.parametrize("kind", ACQUISITIONS)
def test_noise_gain_is_that_of_theory(kind):
    size, deviation = Size(5, 7), 1e-3
    world = _world(size, camera=Size(60, 70), channels=1)
    camera = SimulatedCamera(full_well=1e9, read_noise=1e6, bits=16, shot_noise=False)
    found = acquire_reference(kind(size), _rig(world, camera))
    q, pixels = Hadamard(size).order, size.pixels
    # Hadamard: 4 q / (q + 1)^2 from the patterns, (2 / (q + 1))^2 from black.
    expected = {BruteForce: 2.0, Hadamard: 4 / (q + 1), FullDFT: 4 / pixels}[kind]
    variance = np.var(found.far - world.far) / deviation**2
    assert variance == pytest.approx(expected, rel=0.04)


def test_patterns_of_eight_bits_leave_equation_three_at_fifty_decibels():
    size = Size(16, 12)
    world = _world(size)
    errors = []
    for refinements in (0, 1, 2):
        photos = [0.5 + world.far @ (p.ravel() / 255.0) for p in FullDFT(size).patterns()]
        photos = np.stack(photos).reshape(2 * size.pixels, -1)
        rows = FullDFT(size, refinements).decode(photos)
        truth = world.far.reshape(-1, size.pixels)
        errors.append(20 * np.log10(np.linalg.norm(truth) / np.linalg.norm(rows - truth)))
    assert 40 < errors[0] < 60
    assert errors[1] > errors[0] + 30
    assert errors[2] > errors[1] + 10


@pytest.mark.parametrize("kind", ACQUISITIONS)
def test_held_bounds_memory_and_changes_nothing(kind, tmp_path):
    size = Size(11, 12)
    rig = _rig(_world(size, camera=Size(60, 60), channels=1))
    acquisition = kind(size)
    free = acquire_reference(acquisition, rig, memory=2**30)
    out = np.empty_like(free.far)
    _peak(lambda: list(itertools.islice(rig.shoot(acquisition.patterns()), 3)))
    own = _peak(lambda: [None for _ in rig.shoot(acquisition.patterns())])
    held = 2**20
    # The photos alone are 0.9 to 1.9 MB, the work on them all at once many times that.
    peak = _peak(lambda: acquire_reference(acquisition, rig, memory=held, out=out, folder=tmp_path))
    assert peak < own + held
    assert _peak(lambda: acquire_reference(acquisition, rig, out=out.copy())) > own + 4 * held
    np.testing.assert_allclose(out, free.far, atol=1e-7)
    assert list(tmp_path.iterdir()) == []


def _peak(work):
    tracemalloc.start()
    try:
        work()
        return tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()


def test_transport_goes_to_a_file_and_into_a_store(tmp_path):
    size = Size(4, 5)
    world = _world(size)
    shape = world.far.shape
    out = np.memmap(tmp_path / "far.bin", dtype=np.float32, mode="w+", shape=shape)
    found = acquire_reference(Hadamard(size), _rig(world), out=out)
    assert found.far is out
    save_exact(found, tmp_path / "found.zarr")
    back = load_exact(tmp_path / "found.zarr")
    assert np.array_equal(back.far, out)
    assert back.name == "Hadamard"


class _Tired:
    """A rig that stops early."""

    def __init__(self, rig, photos):
        self._rig, self._photos = rig, photos
        self.projector, self.full_scale = rig.projector, rig.full_scale

    def describe(self):
        return {}

    def shoot(self, patterns):
        return itertools.islice(self._rig.shoot(patterns), self._photos)


@pytest.mark.parametrize("photos", [0, 5])
def test_a_rig_that_stops_early_is_refused(photos):
    rig = _Tired(_rig(_world(Size(4, 5))), photos)
    with pytest.raises(InputError, match=rf"took {photos} photos of the 21 .*: shoot them all\.$"):
        acquire_reference(BruteForce(Size(4, 5)), rig)


def test_faults_are_told_in_a_sentence(tmp_path):
    rig = _rig(_world(Size(4, 5)))
    with pytest.raises(InputError, match=r"a projector of 5x4, the rig has 4x5: make it for"):
        acquire_reference(BruteForce(Size(5, 4)), rig)
    with pytest.raises(InputError, match=r"float64 of shape .*: give float32 of shape"):
        acquire_reference(BruteForce(Size(4, 5)), rig, out=np.empty((2, 12, 20)))
    with pytest.raises(StorageError, match=r"cannot be kept in .*: make room or name another"):
        acquire_reference(BruteForce(Size(4, 5)), rig, memory=1, folder=tmp_path / "nowhere")
