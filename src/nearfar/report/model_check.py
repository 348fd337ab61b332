"""How well the paper's model holds on a scene: a table, and a page with maps."""

from collections.abc import Mapping
from html import escape
from typing import Any

import numpy as np

from nearfar.arrays import Size
from nearfar.markup import numbers
from nearfar.report.page import colour_map, facts, page
from nearfar.workflow.check import ModelCheck, numbers_of
from nearfar.workflow.conditioning import Conditioning

HEAD = ("", "assumed", "measured")


def check_rows(check: Mapping[str, Any]) -> list[list[str]]:
    """Return table rows of what the model assumes and what `numbers_of` a check measured."""
    condition = check["condition"]
    far = "x".join(str(side) for side in check["far"])
    return [
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


def check_page(name: str, check: ModelCheck, condition: Conditioning, camera: Size) -> str:
    """Return a page on how well the model holds on a scene.

    Parameters
    ----------
    name : str
        Name of the scene.
    check : ModelCheck
        Its maps are drawn if it covers every camera pixel.
    condition : Conditioning
    camera : Size
    """
    shares = facts([(f"{share:.1%}", f"{part} light") for part, share in check.floodlit.items()])
    maps = ""
    if check.camera_pixels == camera.pixels:
        captioned = (
            (check.far_beyond_map, "far-range energy beyond k_far and outside the window"),
            (check.checkerboard_map, "N + F over D at the checkerboard"),
        )
        maps = "".join(_map(values.reshape(camera), caption) for values, caption in captioned)
        maps = f'<h2>Where it does not</h2><div class="maps">{maps}</div>'
    body = f"""
<h1>Where the model holds: {escape(name)}</h1>
<p>The method takes each camera pixel's near-range light to come from a window of {check.window} x
{check.window} projector pixels and to vary no faster than k_near, its far-range light to lie in a
band of {check.far} frequencies, and both to be silent at the checkerboard. Shares are of energy,
over {check.camera_pixels} camera pixels.</p>
{shares}
{numbers(list(HEAD), check_rows(numbers_of(check, condition)))}
{maps}
"""
    return page(f"nearfar: where the model holds on {name}", body)


def _map(values: Any, caption: str) -> str:
    high = float(np.nanpercentile(values, 99)) if np.isfinite(values).any() else 0.0
    return colour_map(100 * values, 0.0, max(100 * high, 1.0), "%", caption)
