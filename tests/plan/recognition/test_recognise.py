"""What pictures that were shown are recognised as."""

from fractions import Fraction

import numpy as np
import pytest

from nearfar.arrays import Size
from nearfar.illumination.pictures import natural_picture
from nearfar.plan import paper_plan, parse_plan
from nearfar.plan.patterns import Shown
from nearfar.plan.recognition import recognise, summarise
from nearfar.plan.recognition.contents import (
    AnyPicture,
    Band,
    Binary,
    Block,
    Checkerboard,
    Code,
    Fringes,
    GrayBit,
    HadamardRow,
    Stripes,
    Uniform,
)
from nearfar.plan.recognition.own import plan_of_pictures, recognised_in
from tests.shown import (
    as_picture,
    fringes,
    gray_code,
    hadamard,
    micro_phase_shifting,
    random_binary,
    single_pixels,
    white_and_black,
    with_inverses,
)

SIZE = Size(24, 40)


def _recognised(pictures):
    return recognise(picture.astype(np.float32) / np.float32(255) for picture in pictures)


def _plan(pictures):
    return plan_of_pictures(_recognised(pictures), lambda number: pictures[number])


@pytest.mark.parametrize("axis", [0, 1])
@pytest.mark.parametrize("size", [SIZE, Size(33, 64), Size(1080, 1920)])
def test_gray_code_is_recognised_bit_by_bit(size, axis):
    pictures = with_inverses(gray_code(size, axis))
    found = _recognised(pictures)
    bits = len(pictures) // 2
    expected = [
        GrayBit(axis=("rows", "columns")[axis], bit=bit, cell=1, first=0, inverse=inverse)
        for bit in reversed(range(bits))
        for inverse in (False, True)
    ]
    assert list(found.contents) == expected
    assert found.inverse_of == tuple(i - 1 if i % 2 else None for i in range(len(pictures)))
    assert f"bits 0 to {bits - 1}, with inverses" in summarise(found)[0]


def test_gray_code_of_cells_and_centred_gray_code_are_recognised():
    cells = np.repeat(np.arange(5), 9)[:40]
    of_cells = [as_picture(np.tile((cells ^ cells >> 1) >> b & 1, (24, 1))) for b in range(3)]
    assert [content.cell for content in _recognised(of_cells).contents] == [9, 9, 9]
    centred = np.arange(40) + 12
    pictures = [as_picture(np.tile((centred ^ centred >> 1) >> b & 1, (24, 1))) for b in range(6)]
    assert [(c.first, c.bit) for c in _recognised(pictures).contents] == [
        (12, bit) for bit in range(6)
    ]


def test_a_gray_code_without_its_finest_bits_says_what_is_missing():
    pictures = gray_code(Size(8, 1024), 1)
    (line,) = summarise(_recognised([*pictures[:4], *pictures[5:]]))
    assert line == "Gray code of columns, bits 0 to 9, without 5 (9 pictures)"


@pytest.mark.parametrize("steps", [3, 4, 8])
@pytest.mark.parametrize("period", [5.0, 17.3, 40.0, 93.7])
def test_fringes_tell_frequency_and_phase(period, steps):
    found = _recognised(fringes(Size(24, 400), 1, [period], steps))
    for step, content in enumerate(found.contents):
        assert isinstance(content, Fringes)
        assert content.period == pytest.approx(period, rel=2e-4)
        off = (content.phase - step / steps + 0.5) % 1.0 - 0.5
        assert abs(off) < 2e-3
        assert (content.mean, content.amplitude) == pytest.approx((0.5, 0.5), abs=2e-3)
        assert content.exponent == 1.0
    (line,) = summarise(found)
    assert f"{steps}-step fringes of columns" in line


def test_fringes_lead_any_way():
    y, x = np.indices((90, 70))
    (content,) = _recognised(
        [as_picture(0.5 + 0.4 * np.cos(2 * np.pi * (0.071 * y - 0.113 * x + 0.2)))]
    ).contents
    assert (content.fy, content.fx) == pytest.approx((0.071, -0.113), abs=1e-4)
    assert content.amplitude == pytest.approx(0.4, abs=2e-3)


@pytest.mark.parametrize("power", [1 / 2.2, 1 / 1.65, 1.65, 2.2])
def test_fringes_that_were_raised_to_a_power_are_recognised(power):
    found = _recognised(fringes(Size(24, 300), 1, [37.0], 3, power))
    for content in found.contents:
        assert isinstance(content, Fringes)
        assert content.exponent == pytest.approx(1 / power, rel=0.03)


@pytest.mark.parametrize("power", [1 / 2.2, 2.2])
@pytest.mark.parametrize("periods", [[192.0], [192.0, 24.0], [150.0, 60.0]])
def test_fringes_of_few_cycles_were_raised_to_the_power_of_the_set(periods, power):
    found = _recognised(fringes(Size(8, 192), 1, periods, 8, power))
    for number, content in enumerate(found.contents):
        assert isinstance(content, Fringes)
        assert content.exponent == pytest.approx(1 / power, rel=0.03)
        assert 1 / content.fx == pytest.approx(periods[number // 8], rel=0.02)


def test_levels_from_a_tenth_to_nine_tenths_are_taken_as_they_are():
    pictures = with_inverses(gray_code(SIZE, 1))
    grey = [np.rint(25.5 + 0.8 * picture).astype(np.uint8) for picture in pictures]
    assert _recognised(grey).contents == _recognised(pictures).contents


def test_other_kinds_have_their_names():
    y, x = np.indices(SIZE)
    row, column, block = np.ones(SIZE), np.zeros(SIZE), np.zeros(SIZE)
    row[3], column[:, 7:10], block[4:8, 32:40] = 0, 1, 1
    random = np.random.default_rng(0)
    pictures = [
        np.full(SIZE, 255),
        np.zeros(SIZE),
        as_picture(row),
        as_picture(column),
        as_picture(block),
        as_picture((y // 4 + x // 8) % 2),
        as_picture(((y + 1) // 4 + (x + 3) // 8 + 1) % 2),
        as_picture((x + 3) // 5 % 2),
        as_picture(np.tile(random.random(40) < 0.5, (24, 1))),
        as_picture(random.random(SIZE) < 0.3),
        as_picture(natural_picture(SIZE, 1)),
    ]
    expected = [
        Uniform(level=1.0),
        Uniform(level=0.0),
        Band(axis="rows", start=3, stop=4, is_white=False),
        Band(axis="columns", start=7, stop=10, is_white=True),
        Block(top=4, left=32, height=4, width=8, is_white=True),
        Checkerboard(height=4, width=8, is_first_white=False),
        Checkerboard(height=4, width=8, top=3, left=5, is_first_white=True),
        Stripes(axis="columns", width=5, first=2, is_first_white=False),
    ]
    *named, code, binary, picture = _recognised(pictures).contents
    assert named == expected
    assert isinstance(code, Code)
    assert isinstance(binary, Binary)
    assert isinstance(picture, AnyPicture)


def test_colours_are_kept_and_equal_channels_are_not_colours():
    random = np.random.default_rng(0)
    colour = (random.random((*SIZE, 3)) * 255).astype(np.uint8)
    assert _recognised([colour]).contents == (AnyPicture(is_colour=True),)


@pytest.mark.parametrize(
    ("pictures", "line"),
    [
        (hadamard(Size(8, 16)), "Hadamard patterns of 8x16, complete (127 pictures)"),
        (with_inverses(hadamard(Size(8, 8))[1:])[:64], "32 of 64 rows"),
        (single_pixels(Size(6, 7)), "one white pixel at a time, all (42 pictures)"),
        (single_pixels(Size(6, 7))[5:], "one white pixel at a time, 37 of 42 (37 pictures)"),
        (random_binary(Size(16, 16), 20), "binary pictures, 50% white on average (20 pictures)"),
        (
            micro_phase_shifting(Size(9, 200), 1),
            "fringes of columns, period 18.5, 17.2, 16, 15.1 and 14.3 pixels (7 pictures)",
        ),
        (
            [as_picture(np.tile(np.eye(40)[i], (24, 1))) for i in range(40)],
            "single white columns, all (40 pictures)",
        ),
    ],
)
def test_sets_are_summarised(pictures, line):
    assert any(line in each for each in summarise(_recognised(pictures)))


def test_every_row_of_a_hadamard_matrix_is_told_from_the_others():
    found = _recognised(hadamard(Size(8, 8)))
    rows = [content.row for content in found.contents if isinstance(content, HadamardRow)]
    assert rows == list(range(1, 64))


def test_noise_and_random_codes_are_no_fringes():
    x = np.arange(64)[None].repeat(64, axis=0)
    wave = 0.5 + 0.3 * np.cos(2 * np.pi * x / 16)
    noisy = as_picture(wave + np.random.default_rng(0).normal(0, 0.02, wave.shape))
    assert _recognised([noisy]).contents == (AnyPicture(),)


@pytest.mark.parametrize(
    "plan",
    [
        paper_plan((16, 20), 5, (3, 3)),
        paper_plan((17, 20), 6, (5, 3), offset="reference"),
        paper_plan((16, 24), 5, (5, 5), correspondence="gray"),
    ],
)
def test_nearfars_own_patterns_make_a_plan_of_their_own(plan):
    pictures = [plan.draw(i) for i in range(len(plan.patterns))]
    found = _plan(pictures)
    assert found.offset == plan.offset
    assert found.correspondence == plan.correspondence
    for number, picture in enumerate(pictures):
        np.testing.assert_array_equal(found.draw(number), picture)
    frequencies = {p.frequency for p in plan.patterns if p.kind in {"cosine", "sine"}}
    assert {p.frequency for p in found.patterns if p.kind in {"cosine", "sine"}} == frequencies
    assert all(isinstance(part, Fraction) for k in frequencies for part in k)


def test_one_picture_that_is_not_nearfars_makes_the_set_somebody_elses():
    plan = paper_plan((16, 20), 5, (3, 3))
    pictures = [plan.draw(i) for i in range(len(plan.patterns))]
    pictures[7] = pictures[7].copy()
    pictures[7][3, 4] ^= 1
    assert _plan(pictures).offset == "shown"


@pytest.mark.parametrize(
    "pictures",
    [
        [*with_inverses(gray_code(SIZE, 1)), *white_and_black(SIZE)],
        [*fringes(SIZE, 1, [9.5], 3, 1.7), *random_binary(SIZE, 2), as_picture(np.eye(24, 40))],
    ],
)
def test_a_plan_of_shown_pictures_is_read_back_as_it_was_written(pictures):
    plan = _plan(pictures)
    assert all(isinstance(pattern, Shown) for pattern in plan.patterns)
    assert parse_plan(plan.to_json()) == plan
    assert summarise(recognised_in(plan)) == summarise(_recognised(pictures))
    assert plan.summary()["photos"]["shown"] == len(pictures)


def test_a_picture_is_the_inverse_of_one_picture_alone():
    first, second = with_inverses(gray_code(SIZE, 1))[:2]
    shown = [each / np.float32(255) for each in (first, second, first, first, second)]
    assert recognise(shown).inverse_of == (None, 0, None, None, 2)
