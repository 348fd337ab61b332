"""Pages of reconstructions from anybody's patterns and of free rows, by the command line."""

import html
import re

import numpy as np
import pytest

from nearfar.arrays import Size
from nearfar.report.maps import TITLES
from nearfar.transport.exact import ExactTransport
from nearfar.transport.store import load_transport
from tests.cli.conftest import check_done, run_nearfar
from tests.report.test_reports import stands_alone
from tests.shown import (
    captured,
    cornell,
    gray_code,
    random_binary,
    single_pixels,
    white_and_black,
    with_inverses,
)

SIZE, CAMERA = Size(8, 16), Size(9, 12)
FREE = ("--no-near", "--no-far")
# What only measured frequencies can tell.
OF_PLANS = ("How well the photos fit", "The plan<", "misfit", "far band", "frequency down")


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Pages and transports of three reconstructions."""
    folder = tmp_path_factory.mktemp("pages")
    light = np.random.default_rng(0).uniform(0, 0.01, (1, CAMERA.pixels, SIZE.pixels))
    lamps = ExactTransport(SIZE, CAMERA, (), (), light.astype(np.float32), "lamps")
    codes = [*gray_code(SIZE, 0), *gray_code(SIZE, 1)]
    sets = {
        "patterns": (
            cornell(SIZE, CAMERA),
            [*codes, *random_binary(SIZE, 50), *white_and_black(SIZE)],
        ),
        "lamps": (lamps, [*with_inverses(random_binary(SIZE, 140)), *white_and_black(SIZE)]),
        "single": (lamps, [*single_pixels(SIZE), white_and_black(SIZE)[1]]),
    }
    for name, (world, pictures) in sets.items():
        captured(world, pictures, folder / name)
        check_done(
            run_nearfar(
                "reconstruct",
                folder / name / "c.zarr",
                folder / f"{name}.zarr",
                "--report",
                folder / f"{name}.html",
                *(() if name == "patterns" else FREE),
            )
        )
    return folder


def _page(folder, name):
    text = (folder / f"{name}.html").read_text()
    stands_alone(text)
    assert not any(words in text for words in OF_PLANS)
    return text, load_transport(folder / f"{name}.zarr")


def _titles(text):
    return {name for name, title in TITLES.items() if f"{title[:1].upper()}{title[1:]}." in text}


def _checked(text):
    """Return the numbers of the held-out photos, their SNR_b and what was expected."""
    table = text.partition(">Checked</h2>")[2].partition("</table>")[0]
    rows = re.findall(r"<td>(\d+): [^<]*</td><td>([\d.]+)</td><td>([\d.]+)</td>", table)
    return np.array(rows, dtype=float).T


@pytest.mark.parametrize("name", ["patterns", "lamps"])
def test_a_page_tells_what_it_was_made_of_and_how_far_it_holds(folder, name):
    text, transport = _page(folder, name)
    verdict = transport.verdict
    assert verdict.grade == "good"
    assert f"<b>good.</b> {html.escape(verdict.summary)}" in text
    assert "What the patterns were recognised as: projector 8x16" in text
    assert "binary pictures, 50% white on average" in text
    assert {"column", "row", "picture-error", "error", "direct-error"} - _titles(text) <= (
        set() if transport.lit.any() else {"column", "row", "direct-error"}
    )
    photos, found, expected = _checked(text)
    assert len(photos) >= 2
    assert np.mean(found) == pytest.approx(verdict.held_out_snr, abs=1.5)
    assert np.mean(expected) == pytest.approx(verdict.expected_snr, abs=1.5)
    # A row of pictures for each of up to four of these photos.
    beside = text.partition("beside held-out photos")[2].partition("<h2")[0]
    assert beside.count("<img") == 4 * min(4, len(photos))
    assert "these among them" in beside


def test_free_rows_are_shown_as_parts_of_their_own(folder):
    text, _ = _page(folder, "lamps")
    assert ">free rows</th>" in text
    assert "near-range" not in text
    assert "from 128 lamps (8x16)" in text
    assert "confidence" not in _titles(text)


def test_the_parts_of_the_model_are_shown_where_it_was_used(folder):
    text, _ = _page(folder, "patterns")
    assert ">near-range</th>" in text
    assert {"confidence", "near-share", "far-share"} <= _titles(text)
    assert "Gray code of rows, bits 0 to 2" in text


def test_what_is_not_known_has_no_section_and_no_empty_map(folder):
    text, transport = _page(folder, "single")
    assert not transport.has_error_bars
    assert not transport.lit.any()
    assert "othing was checked" in text
    assert ">Checked</h2>" not in text
    assert ">How sure</h2>" not in text
    assert _titles(text) == {"saturated"}
    assert "by least squares, without any prior" in text
