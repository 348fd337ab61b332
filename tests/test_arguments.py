"""What cannot be used is refused by a sentence, alike at every public entry; lists are arrays."""

import numpy as np
import pytest
from scipy import sparse

import nearfar
from nearfar.errors import InputError
from nearfar.photometry.theory import measure_in_theory
from tests.worlds import model_transport

SIZE = nearfar.Size(6, 7)
WORLD = model_transport(SIZE, SIZE, window=3, far=nearfar.Size(3, 3))
EXACT = nearfar.ExactTransport(SIZE, SIZE, (), (), WORLD.dense().transpose(1, 0, 2))
PREPARED = nearfar.prepare_transport(WORLD)
OPERATOR = WORLD.as_linear_operator()
GOOD = np.full(SIZE, 0.5)
PLAN = nearfar.paper_plan(SIZE, 3, (3, 3))
LIT = nearfar.given_correspondence(np.ones((*SIZE, 2)), SIZE, SIZE)
MEASURED = measure_in_theory(
    nearfar.paper_plan(SIZE, 3, (3, 3), offset="none", correspondence="none"), WORLD
)


def _bad_arrays(good):
    """Yield arrays that cannot be used in the place of a good one."""
    one = np.array(good, dtype=float)
    for value in (np.nan, np.inf):
        yield f"{value}", np.where(np.arange(one.size).reshape(one.shape) == 1, value, one)
    yield "complex", one.astype(complex)
    yield "text", one.astype(str)
    yield "dates", np.full(one.shape, np.datetime64("2026-01-01"))
    yield "objects", one.astype(object)
    yield "another shape", one[..., 1:]
    yield "a number", 0.5
    yield "ragged", [[1.0, 2.0], [1.0]]
    yield "None", None


BAD_NUMBERS = {
    "nan": np.nan,
    "inf": -np.inf,
    "complex": 1j,
    "text": "1",
    "a date": np.datetime64("2026-01-01"),
    "an object": object(),
    "an array": np.ones(2),
    "None": None,
}
BAD_COUNTS = {**BAD_NUMBERS, "a fraction": 1.5, "a whole float": 2.0, "a bool": True}
# A seed and a place are counted from 0; negative ones are refused, too.
BAD_COUNTS_FROM_0 = {**BAD_COUNTS, "negative": -1}
BAD_OPTIONAL_COUNTS = {what: bad for what, bad in BAD_COUNTS_FROM_0.items() if bad is not None}
BAD_SIZES = {
    "one side": (6,),
    "three sides": (6, 7, 1),
    "fractions": (6.5, 7),
    "whole floats": (6.0, 7.0),
    "negative": (-6, 7),
    "zero": (0, 7),
    "bools": (True, True),
    "text": "67",
    "texts": ("6", "7"),
    "nan": (np.nan, 7),
    "a number": 6,
    "None sides": (None, None),
}
ARRAYS = {
    "Transport @": (GOOD, WORLD.__matmul__),
    "components": (GOOD, WORLD.components),
    "relight": (GOOD, WORLD.relight),
    "pictures": (GOOD[None], WORLD.pictures),
    "adjoint": (GOOD, WORLD.adjoint),
    "H @": (GOOD, WORLD.H.__matmul__),
    "ExactTransport @": (GOOD, EXACT.__matmul__),
    "ExactTransport.pictures": (GOOD[None], EXACT.pictures),
    "ExactTransport.adjoint": (GOOD, EXACT.adjoint),
    "ExactTransport.H @": (GOOD, EXACT.H.__matmul__),
    "PreparedTransport @": (GOOD, PREPARED.__matmul__),
    "PreparedTransport.pictures": (GOOD[None], PREPARED.pictures),
    "ExactTransport": (
        np.ones((1, 42, 42)),
        lambda far: nearfar.ExactTransport(SIZE, SIZE, (), (), far),
    ),
    "snr, truth": (GOOD, lambda truth: nearfar.snr(truth, GOOD)),
    "snr, estimate": (GOOD, lambda estimate: nearfar.snr(GOOD, estimate)),
    "relighting_snr": (GOOD, lambda light: nearfar.relighting_snr(WORLD, EXACT, {"a": light})),
}
NUMBERS = {
    f"{method.__qualname__}, {gain}": lambda value, method=method, gain=gain, given=given: method(
        *given, **{gain: value}
    )
    for method, given in (
        (WORLD.relight, (GOOD,)),
        (WORLD.with_gains, ()),
        (PREPARED.pictures, (GOOD[None],)),
    )
    for gain in ("direct", "near", "far")
} | {
    "Transport *": WORLD.__mul__,
    "* Transport": WORLD.__rmul__,
    "ExactTransport *": EXACT.__mul__,
    "choose_plan, noise": lambda noise: nearfar.choose_plan((8, 8), 30, noise=noise),
}
COUNTS = {
    "column, y": lambda y: WORLD.column(y, 1),
    "estimate_transport, window": lambda window: nearfar.estimate_transport(
        MEASURED, LIT, window, (3, 3)
    ),
    "column, x": lambda x: WORLD.column(1, x),
    "natural_picture, seed": lambda seed: nearfar.natural_picture(SIZE, seed),
    "random_pattern, seed": lambda seed: nearfar.random_pattern(SIZE, seed),
    "as_linear_operator": WORLD.as_linear_operator,
    "paper_plan, window": lambda window: nearfar.paper_plan(SIZE, window, (3, 3)),
    "choose_plan, photos": lambda photos: nearfar.choose_plan((8, 8), photos),
    "condition_near, window": lambda window: nearfar.condition_near(SIZE, window, (1, 1)),
    "check_model, window": lambda window: nearfar.check_model(WORLD, window, (3, 3)),
}
# Left out, each has a default.
OPTIONAL_COUNTS = {
    "check_model, sample": lambda sample: nearfar.check_model(WORLD, 3, (3, 3), sample=sample),
}
SIZES = {
    "white": nearfar.white,
    "penguin": nearfar.penguin,
    "natural_picture": lambda size: nearfar.natural_picture(size, 1),
    "random_pattern": lambda size: nearfar.random_pattern(size, 1),
    "paper_plan, projector": lambda size: nearfar.paper_plan(size, 3, (3, 3)),
    "choose_plan": lambda size: nearfar.choose_plan(size, 30),
    "given_correspondence, camera": lambda size: nearfar.given_correspondence(
        np.ones((6, 7, 2)), size, SIZE
    ),
    "given_correspondence, projector": lambda size: nearfar.given_correspondence(
        np.ones((6, 7, 2)), SIZE, size
    ),
    "ExactTransport": lambda size: nearfar.ExactTransport(size, SIZE, (), (), EXACT.far),
    "condition_near": lambda size: nearfar.condition_near(size, 3, (1, 1)),
    "open_rig": lambda size: nearfar.open_rig("cornell", size),
}
CASES = {
    f"{entry}: {what}": (call, value)
    for table, bad in (
        (NUMBERS, BAD_NUMBERS),
        (COUNTS, BAD_COUNTS_FROM_0),
        (OPTIONAL_COUNTS, BAD_OPTIONAL_COUNTS),
        (SIZES, BAD_SIZES),
    )
    for entry, call in table.items()
    for what, value in bad.items()
} | {
    f"{entry}: {what}": (call, value)
    for entry, (good, call) in ARRAYS.items()
    for what, value in _bad_arrays(good)
}


@pytest.mark.parametrize("case", CASES)
def test_what_cannot_be_used_is_refused_by_a_sentence(case):
    call, value = CASES[case]
    with pytest.raises(InputError) as refused:
        call(value)
    said = str(refused.value)
    assert said.endswith(".")
    assert len(said.split()) > 6


# What each takes, and what a newcomer gives in its place.
OBJECTS = {
    "acquire, plan": lambda given, path: nearfar.acquire(given, path, None),
    "acquire, rig": lambda given, path: nearfar.acquire(PLAN, path, given),
    "write_capture": lambda given, path: nearfar.write_capture(given, path, []),
    "measure": lambda given, _path: nearfar.measure(given),
    "correspond": lambda given, _path: nearfar.correspond(given),
    "estimate_transport, measurements": lambda given, _path: nearfar.estimate_transport(
        given, LIT, 3, (3, 3)
    ),
    "reconstruct": lambda given, _path: nearfar.reconstruct(given),
    "reconstruct_to_file": nearfar.reconstruct_to_file,
    "prepare_transport": lambda given, _path: nearfar.prepare_transport(given),
    "save_transport": nearfar.save_transport,
}


@pytest.mark.filterwarnings("ignore:.* with the path as its first argument")
@pytest.mark.parametrize("entry", OBJECTS)
@pytest.mark.parametrize("given", [None, 3, "capture.zarr", GOOD, EXACT])
def test_an_object_of_another_type_is_named_and_nothing_is_written(entry, given, tmp_path):
    with pytest.raises(InputError, match=r"^a \w+ was given for the \w+, .*: give what nearfar"):
        OBJECTS[entry](given, tmp_path / "made.zarr")
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("entry", ARRAYS)
def test_a_list_is_an_array(entry):
    good, call = ARRAYS[entry]
    call(good.tolist())


@pytest.mark.parametrize("entry", [name for name in SIZES if name != "open_rig"])
def test_a_size_is_two_whole_numbers_of_any_sort(entry):
    side = (8, 8) if entry == "choose_plan" else SIZE
    for size in (tuple(side), list(side), np.array(side), tuple(np.int16(n) for n in side)):
        SIZES[entry](size)


def test_q_may_be_a_list():
    q = np.stack(np.indices(SIZE), axis=-1)
    found = nearfar.given_correspondence(q.tolist(), SIZE, SIZE)
    np.testing.assert_array_equal(found.q, q)


@pytest.mark.parametrize("operator", [WORLD, EXACT, PREPARED, WORLD.H, EXACT.H])
def test_an_operator_is_not_an_array(operator):
    with pytest.raises(InputError, match="operator and not an array"):
        np.asarray(operator)


@pytest.mark.parametrize("operator", [WORLD, EXACT, 2 * WORLD, EXACT * -0.5, WORLD.H.H * 3])
def test_the_adjoint_is_the_adjoint(operator):
    generator = np.random.default_rng(5)
    light, image = generator.random((2, *SIZE))
    one, other = np.vdot(operator @ light, image), np.vdot(light, operator.H @ image)
    assert one == pytest.approx(other, rel=1e-5)
    assert operator.H.H is operator
    np.testing.assert_allclose((2 * operator.H) @ image, 2 * (operator.H @ image), rtol=1e-6)


@pytest.mark.parametrize("operator", [WORLD, EXACT])
def test_a_factor_scales_pictures(operator):
    for factor in (2, 0.5, np.float32(-1.5), np.int64(3)):
        expected = factor * (operator @ GOOD)
        np.testing.assert_allclose((factor * operator) @ GOOD, expected, rtol=1e-5, atol=1e-6)
        np.testing.assert_allclose((operator * factor) @ GOOD, expected, rtol=1e-5, atol=1e-6)


def test_one_light_in_the_place_of_several_is_told_apart():
    for operator in (WORLD, EXACT, PREPARED):
        with pytest.raises(
            InputError, match=r"several are expected: give n x 6x7, `light\[None\]`"
        ):
            operator.pictures(GOOD)


def test_an_exact_transport_of_direct_or_near_light_alone_is_refused():
    part = (sparse.csr_array(np.eye(42, dtype=np.float32)),)
    for direct, near in ((part, ()), ((), part)):
        with pytest.raises(InputError, match="direct and near must both be given"):
            nearfar.ExactTransport(SIZE, SIZE, direct, near, EXACT.far)


@pytest.mark.parametrize("window", [0, 8, 100])
def test_a_window_beyond_the_projector_is_refused(window):
    with pytest.raises(InputError, match=r"window|W = "):
        nearfar.estimate_transport(MEASURED, LIT, window, (3, 3))


@pytest.mark.parametrize("exposure", [0, -1.0, np.nan, "1"])
def test_an_exposure_that_cannot_be_is_refused(exposure):
    with pytest.raises(InputError, match="exposure"):
        nearfar.open_rig("cornell", SIZE, exposure=exposure)


def test_progress_that_is_no_function_is_refused(tmp_path):
    with pytest.raises(InputError, match="progress is a int"):
        nearfar.write_capture(PLAN, tmp_path / "c.zarr", [], progress=5)
