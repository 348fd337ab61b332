"""Exact operators: linear, with their adjoint, the same from a file, and no damage unseen."""

from pathlib import Path

import numpy as np
import pytest
from scipy import sparse

from nearfar.arrays import Size
from nearfar.errors import InputError, UnreadableFileError
from nearfar.transport.exact_operator import ExactOperator
from nearfar.transport.exact_store import load_exact, save_exact
from nearfar.transport.mediated import ConvolvedBetween, DenseBetween, Mediated
from nearfar.transport.operator_store import load_operator, save_operator
from tests.metadata import change_attributes

PROJECTOR, CAMERA = Size(7, 6), Size(5, 8)
CHANNELS = 3
LATTICE = (4, 3, 5)
PADDED = (8, 6, 10)


def matrix(generator, rows, columns):
    return sparse.random_array(
        (rows, columns), density=0.2, format="csr", dtype=np.float32, rng=generator
    )


def kernel(generator):
    """Values of a distance, symmetric along each axis."""
    sides = [np.minimum(np.arange(n), n - np.arange(n)) for n in PADDED]
    square = sum(np.square(side) for side in np.meshgrid(*sides, indexing="ij"))
    return np.exp(-generator.random() * square)


@pytest.fixture(scope="module")
def operator():
    generator = np.random.default_rng(3)
    direct = matrix(generator, CAMERA.pixels, PROJECTOR.pixels)
    entries = [generator.random(direct.nnz).astype(np.float32) for _ in range(CHANNELS)]
    spectra = [np.fft.rfftn(kernel(generator)).real for _ in range(CHANNELS)]
    inside = ConvolvedBetween(LATTICE, np.array(spectra, dtype=np.float32), PADDED)
    nodes = 9
    square = generator.random((CHANNELS, nodes, nodes)).astype(np.float32)
    between = DenseBetween(square + square.transpose(0, 2, 1))

    def mediated(between):
        sides = [matrix(generator, size.pixels, between.nodes) for size in (CAMERA, PROJECTOR)]
        return Mediated(*sides, between)

    return ExactOperator(
        PROJECTOR,
        CAMERA,
        tuple(
            sparse.csr_array((values, direct.indices, direct.indptr), shape=direct.shape)
            for values in entries
        ),
        mediated(inside),
        mediated(between),
        "made up",
    )


@pytest.fixture(scope="module")
def dense(operator):
    """D, N and F as (channels, C, P), from their factors one by one."""
    near, far = operator.near, operator.far
    offset = np.fft.irfftn(operator.near.between.spectra, PADDED, axes=(1, 2, 3))
    place = np.stack(np.unravel_index(np.arange(np.prod(LATTICE)), LATTICE), axis=-1)
    apart = np.abs(place[:, None] - place)
    kernels = offset[:, apart[..., 0], apart[..., 1], apart[..., 2]]
    return (
        np.stack([part.toarray() for part in operator.direct]),
        near.camera.toarray() @ kernels @ near.projector.toarray().T,
        far.camera.toarray() @ far.between.matrices @ far.projector.toarray().T,
    )


def test_pictures_are_those_of_the_factors_product(operator, dense):
    generator = np.random.default_rng(0)
    lights = generator.random((9, *PROJECTOR, CHANNELS)).astype(np.float32)
    expected = np.einsum("kcp,npk->nck", sum(dense), lights.reshape(9, -1, CHANNELS))
    found = operator.pictures(lights)
    assert found.dtype == np.float32
    assert found == pytest.approx(expected.reshape(9, *CAMERA, CHANNELS), rel=1e-4)
    # A grey light is the same in all channels.
    grey = lights[..., 0]
    assert operator.pictures(grey) == pytest.approx(
        operator.pictures(grey[..., None].repeat(CHANNELS, axis=-1)), rel=1e-5
    )
    assert operator @ lights[3] == pytest.approx(found[3], rel=1e-5)
    assert sum(operator.component_pictures(grey[0])) == pytest.approx(operator @ grey[0], rel=1e-5)


def test_rows_are_those_of_the_factors_product(operator, dense):
    for pixels in (slice(None), slice(3, 20, 4), slice(7, 8), slice(5, 5)):
        components = operator.component_rows(pixels)
        for found, expected in zip(components, dense, strict=True):
            assert found == pytest.approx(expected[:, pixels].swapaxes(0, 1), rel=1e-4, abs=1e-5)
        assert operator.rows(pixels) == pytest.approx(sum(components), rel=1e-6)


def test_the_adjoint_is_the_transpose(operator, dense):
    image = np.random.default_rng(1).random((*CAMERA, CHANNELS)).astype(np.float32)
    expected = np.einsum("kcp,ck->pk", sum(dense), image.reshape(-1, CHANNELS))
    found = operator.H @ image
    assert found == pytest.approx(expected.reshape(*PROJECTOR, CHANNELS), rel=1e-4)
    light = np.random.default_rng(2).random((*PROJECTOR, CHANNELS))
    assert np.vdot(operator @ light, image) == pytest.approx(np.vdot(light, found), rel=1e-5)


def test_a_multiple_is_of_all_components(operator):
    light = np.ones(PROJECTOR)
    twice = (2 * operator).component_pictures(light)
    for one, other in zip(operator.component_pictures(light), twice, strict=True):
        assert other == pytest.approx(2 * one)
        assert other.any()


def test_q_is_the_centroid_of_direct_light(operator, dense):
    weight = dense[0].sum(axis=0)
    y, x = np.divmod(np.arange(PROJECTOR.pixels), PROJECTOR.width)
    lit = weight.any(axis=1)
    assert lit.sum() > 0
    assert np.array_equal(operator.lit.ravel(), lit)
    q = operator.correspondence.reshape(-1, 2)[lit]
    total = weight[lit].sum(axis=1)
    assert q[:, 0] == pytest.approx(weight[lit] @ y / total, rel=1e-5)
    assert q[:, 1] == pytest.approx(weight[lit] @ x / total, rel=1e-5)


def test_factors_that_do_not_fit_are_named(operator):
    with pytest.raises(InputError, match="do not fit a camera of 4x8"):
        ExactOperator(PROJECTOR, (4, 8), operator.direct, None, operator.far)
    with pytest.raises(InputError, match="differ in their channels"):
        ExactOperator(PROJECTOR, CAMERA, operator.direct[:2], None, operator.far)
    with pytest.raises(InputError, match="weights are of 60 nodes"):
        Mediated(operator.near.camera, operator.far.projector, operator.far.between)
    with pytest.raises(InputError, match="resize the light to 7x6"):
        operator @ np.ones((6, 7))
    with pytest.raises(InputError, match="give an image of that shape"):
        operator.adjoint(np.ones(CAMERA))
    with pytest.raises(InputError, match="not a slice"):
        operator.rows(3)
    with pytest.raises(InputError, match="operator and not an array"):
        np.asarray(operator)


@pytest.fixture
def stored(operator, tmp_path):
    save_operator(operator, tmp_path / "o.zarr")
    return tmp_path / "o.zarr"


def test_an_operator_is_the_same_from_a_file(operator, stored):
    light = np.random.default_rng(5).random((*PROJECTOR, CHANNELS))
    again = load_exact(stored)
    assert (again.name, again.projector, again.camera) == ("made up", PROJECTOR, CAMERA)
    for one, other in zip(
        operator.component_pictures(light), again.component_pictures(light), strict=True
    ):
        assert np.array_equal(one, other)


def test_channels_with_indices_of_their_own_and_no_near_are_the_same_from_a_file(
    operator, tmp_path: Path
):
    generator = np.random.default_rng(6)
    direct = [matrix(generator, CAMERA.pixels, PROJECTOR.pixels) for _ in range(CHANNELS)]
    alone = ExactOperator(PROJECTOR, CAMERA, tuple(direct), None, operator.far)
    save_exact(alone, tmp_path / "o.zarr")
    again = load_operator(tmp_path / "o.zarr")
    assert again.near is None
    for one, other in zip(direct, again.direct, strict=True):
        assert np.array_equal(one.toarray(), other.toarray())


def test_a_flipped_bit_of_any_file_is_seen(stored):
    files = sorted(path for path in stored.rglob("*") if path.is_file())
    assert len(files) > 30
    for path in files:
        whole = path.read_bytes()
        middle = len(whole) // 2
        path.write_bytes(whole[:middle] + bytes([whole[middle] ^ 4]) + whole[middle + 1 :])
        with pytest.raises(UnreadableFileError, match="damaged"):
            load_operator(stored)
        path.write_bytes(whole)
    load_operator(stored)


@pytest.mark.parametrize(
    "changes",
    [
        {"channels": 4},
        {"channels": 0},
        {"camera": [4, 8]},
        {"projector": "large"},
        {"far": None},
        {"far": {"nodes": [8]}},
        {"near": {"lattice": [4, 3, 5], "padded": [4, 3, 5]}},
        {"near": {"lattice": [4, 3], "padded": [8, 6]}},
    ],
)
def test_an_operator_that_contradicts_itself_is_refused(stored, changes):
    change_attributes(stored, **changes)
    with pytest.raises(UnreadableFileError, match="damaged"):
        load_operator(stored)
