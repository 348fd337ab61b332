"""How well the paper's model holds on a scene: a table, and a page with maps."""

from collections.abc import Mapping
from html import escape
from typing import Any

import numpy as np

from nearfar.arrays import Size
from nearfar.decibels import in_words
from nearfar.markup import numbers
from nearfar.report.methods import check_methods
from nearfar.report.page import colour_map, facts, listed, page, verdict_box
from nearfar.workflow.check import ModelCheck
from nearfar.workflow.conditioning import Conditioning
from nearfar.workflow.verdict.model_check import (
    DOUBTFUL_DECIBELS,
    DOUBTFUL_ROW_DECIBELS,
    GOOD_DECIBELS,
    GOOD_ROW_DECIBELS,
    judge_check,
    numbers_of,
)

# What the table and the maps speak of, for readers who have not read the method.
WORDS = (
    ("D, direct light", "of each camera pixel: comes from the projector pixels at q, four at most"),
    ("q", "the projector pixel that lights a camera pixel directly"),
    ("N, near-range light", "comes from projector pixels about q: scattered under the surface"),
    ("W, the window", "the square of W x W projector pixels about q that is to hold N"),
    ("F, far-range light", "comes from everywhere by way of other surfaces, and varies slowly"),
    ("far band, k_far", "the few low frequencies, over the whole projector, that are to hold F"),
    ("k_near", "the frequency beyond which N is taken to be silent, cycles per projector pixel"),
    (
        "checkerboard",
        "the finest pattern, every other pixel lit: D alone should answer to it, and the paper's "
        "estimate of D takes all of the answer for D",
    ),
    (
        "condition",
        "by how much noise in the direction of a window that the patterns see worst exceeds that "
        "in the best one; 1 is ideal",
    ),
    (
        "SNR_b, SNR_t",
        "20 log10 of a relit picture's, or a row's, length over that of its error: 20 dB is 10 % "
        "off",
    ),
    (
        "good, doubtful, wrong",
        f"good: the best D + N + F with this W and far band, without noise, relights pictures at "
        f"{GOOD_DECIBELS:g} dB or more and has an SNR_t of {GOOD_ROW_DECIBELS:g} dB or more; "
        f"doubtful: {DOUBTFUL_DECIBELS:g} and {DOUBTFUL_ROW_DECIBELS:g} dB; wrong: less",
    ),
)
HEAD = ("", "assumed", "measured")
SPLIT_BY_MODEL = (
    " The transport's components are not known apart, so they are split as the model fits them "
    "best: q where a row peaks, N inside the window by definition, F the rest."
)


def check_rows(check: Mapping[str, Any]) -> list[list[str]]:
    """Return table rows of what the model assumes and what `numbers_of` a check measured."""
    condition = check["condition"]
    far = "x".join(str(side) for side in check["far"])
    return [
        [
            "the best that the model can do, without noise",
            "",
            f"{in_words(check['best_pictures'])} under pictures, {in_words(check['best_rows'])} in "
            f"SNR_t of the median camera pixel",
        ],
        ["camera pixels with direct light", "all", f"{check['lit']:.1%}"],
        ["N outside the window", "none", f"{check['near_outside']:.2%} of its energy"],
        [
            f"N beyond k_near = {check['k_near']:.3f} cycles/pixel",
            "little",
            f"{check['near_beyond']:.1%} of its energy",
        ],
        [
            f"F beyond k_far (a band of {far})",
            "little",
            f"{check['far_beyond']:.1%} of its energy, of which "
            f"{check['far_beyond_in_window']:.1%} lies inside the window and is taken up by n",
        ],
        [
            "N at the checkerboard",
            "none",
            f"{check['checkerboard_near']:.2%} of D's amplitude",
        ],
        [
            "F at the checkerboard",
            "none",
            f"{check['checkerboard_far']:.2%} of D's amplitude",
        ],
        [
            "condition of the near patterns over a whole window",
            "1 (equation 5)",
            f"{condition['whole']:.3f}, {condition['unseen']} direction"
            f"{'s' if condition['unseen'] != 1 else ''} unseen",
        ],
        [
            "the same, windows cut by the projector's border",
            "",
            f"{condition['worst']:.2f} at worst, of {condition['windows']} kinds",
        ],
    ]


def check_page(
    name: str,
    check: ModelCheck,
    condition: Conditioning,
    camera: Size,
    command: str | None = None,
) -> str:
    """Return a page on how well the model holds on a scene.

    Parameters
    ----------
    name : str
        Name of the scene.
    check : ModelCheck
        Its maps are drawn if it covers every camera pixel.
    condition : Conditioning
    camera : Size
    command : str, optional
        As `nearfar.report.page.page` takes it.
    """
    verdict = judge_check(check)
    shares = facts([(f"{share:.1%}", f"{part} light") for part, share in check.floodlit.items()])
    maps = ""
    if check.camera_pixels == camera.pixels:
        captioned = (
            (
                check.far_beyond_map,
                "far-range energy beyond k_far and outside the window",
                "Bright: light that neither the window nor the far band holds, as at creases and "
                "mirrors. A larger far band or W helps there.",
            ),
            (
                check.checkerboard_map,
                "N + F over D at the checkerboard",
                "Bright: the paper's direct light is off by this share. Grey: no direct light.",
            ),
        )
        maps = "".join(_map(values.reshape(camera), *texts) for values, *texts in captioned)
        maps = f'<h2>Where it does not</h2><div class="maps">{maps}</div>'
    body = f"""
<h1>Where the model holds: {escape(name)}</h1>
{verdict_box(verdict.grade, verdict.says)}
{listed(list(verdict.causes)) if verdict.causes else ""}
<p>The method takes each camera pixel's near-range light to come from a window of {check.window} x
{check.window} projector pixels and to vary no faster than k_near, its far-range light to lie in a
band of {check.far} frequencies, and both to be silent at the checkerboard. Shares are of energy,
over {check.camera_pixels} camera pixels.{SPLIT_BY_MODEL if check.is_split_by_model else ""}</p>
{shares}
{numbers(list(HEAD), check_rows(numbers_of(check, condition)))}
{maps}
<h2>Words</h2>
<div class="words">{numbers(["word", "meaning"], [list(pair) for pair in WORDS])}</div>
"""
    title = f"nearfar: where the model holds on {name}"
    return page(title, body, methods=check_methods(check), command=command)


def _map(values: Any, caption: str, reading: str) -> str:
    high = float(np.nanpercentile(values, 99)) if np.isfinite(values).any() else 0.0
    return colour_map(100 * values, 0.0, max(100 * high, 1.0), "%", caption, reading=reading)
