"""The demo's report, laid out like the paper's figure 2."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from nearfar.arrays import Floats
from nearfar.correspondence import Correspondence
from nearfar.decibels import in_words
from nearfar.estimate.physical import PhysicalSplit, split_physically
from nearfar.markup import numbers, picture
from nearfar.plan import Plan
from nearfar.report.differences import difference_gain
from nearfar.report.evaluation import FREQUENCIES_READING, ROWS_READING
from nearfar.report.maps import READINGS
from nearfar.report.methods import reconstruction_methods
from nearfar.report.page import colour_map, facts, gallery, page
from nearfar.report.splits import PHYSICAL_NAMES, splits_section
from nearfar.report.transport_page import kept_verdict_box
from nearfar.transport.exact import ExactTransport
from nearfar.transport.model import Transport
from nearfar.transport.verdict import KeptVerdict
from nearfar.workflow.evaluate import Rows


def demo_page(
    plan: Plan,
    transport: Transport,
    truth: ExactTransport,
    correspondence: Correspondence,
    lights: Mapping[str, Floats],
    judgement: Mapping[str, Any],
    rows: Rows,
    verdict: KeptVerdict,
    seconds: Mapping[str, float],
    command: str | None = None,
) -> str:
    """Return the report of a demo as one self-contained HTML page.

    Parameters
    ----------
    plan : Plan
    transport : Transport
        Reconstructed from the photos.
    truth : ExactTransport
        Of the simulated scene.
    correspondence : Correspondence
    lights : mapping of str to ndarray
        Lights to relight with, by name.
    judgement : mapping
        As `nearfar.workflow.judge.judge_by_truth` returns it.
    rows : Rows
    verdict : KeptVerdict
        On the transport, by its capture alone.
    seconds : mapping of str to float
        Duration of each step, by name.
    command : str, optional
        As `nearfar.report.page.page` takes it.
    """
    snr_b = judgement["snr_b"]
    photos, brute_force = len(plan.patterns), plan.projector.pixels
    cards = facts(
        [
            (str(photos), "photos in all, those of white and black too"),
            (f"{brute_force / photos:.1f}×", f"fewer than {brute_force} by brute force"),
            (in_words(judgement["snr_b_pictures"]), "SNR_b, mean of five pictures"),
            (in_words(snr_b["white"]), "SNR_b under floodlight, which was measured itself"),
            (in_words(judgement["snr_t"]["p50"]), "SNR_t, median camera pixel"),
        ]
    )
    gain = difference_gain((transport @ light) - (truth @ light) for light in lights.values())
    columns = ["light", *PHYSICAL_NAMES.values(), "sum: relit", "photo (exact)"]
    columns.append(f"difference × {gain}")
    split = split_physically(transport)
    rows_of_pictures = [
        (name, _row(name, light, split, truth, gain)) for name, light in lights.items()
    ]
    galleries = gallery(columns, rows_of_pictures)
    ceiling = judgement["ceiling"]["snr_b"]
    table = numbers(
        ["light", "SNR_b", "ceiling of the model, no noise"],
        [[name, in_words(value), in_words(ceiling[name])] for name, value in snr_b.items()],
    )
    times = ", ".join(f"{name} {value:.1f} s" for name, value in seconds.items())
    body = f"""
<h1>A scene's light transport, taken apart</h1>
{kept_verdict_box(verdict)}
<p>A projector of {plan.projector} pixels and a camera of {transport.camera} look at a box with red
and green walls, a glossy cup and a translucent candle. The photos are simulated with shot and read
noise. Every camera pixel's transport was reconstructed from {photos} of them, which also tell the
projector pixel that lights it, and the scene relit under light that was never projected.</p>
{cards}
<h2>Relighting, components apart</h2>
<p>These components are those of the physical split. Direct light holds the highlights, subsurface
light is what travels under the candle's skin, and inter-reflection brings the walls' red and green
to candle and cup. Subsurface light is shown twice as bright. The exact picture stands beside the
sum, and their difference, {gain} times as bright.</p>
{galleries}
<h2>How close</h2>
<p>SNR_b compares relit pictures with exact ones. The ceiling is the best that direct light, a
window of {transport.window} × {transport.window} and the far band could do on this scene.</p>
{table}
{splits_section(judgement)}
<h2>Where it is good, and where less</h2>
<div class="maps">{_maps(transport, correspondence, rows)}</div>
<p></p>
<p>{times}.</p>
"""
    checked = "Relit pictures were compared with those of the simulated scene, which are exact."
    methods = reconstruction_methods(transport, plan, checked)
    title = "nearfar: light transport, taken apart"
    return page(title, body, methods=methods, command=command)


def _row(
    name: str, light: Floats, split: PhysicalSplit, truth: ExactTransport, gain: int
) -> list[str]:
    direct, subsurface, rest = split.components(light)
    relit, exact = split.transport @ light, truth @ light
    difference = gain * np.abs(relit - exact)
    images = [light, direct, 2 * subsurface, rest, relit, exact, difference]
    names = ["light", *PHYSICAL_NAMES.values(), "relit", "exact", "difference"]
    return [
        picture(image, f"{part} under {name}") for image, part in zip(images, names, strict=True)
    ]


def _maps(transport: Transport, correspondence: Correspondence, rows: Rows) -> str:
    q = correspondence.q
    height, width = transport.projector
    low, high = np.nanpercentile(rows.snr_b_of_frequency, [1, 99])
    low_t, high_t = np.nanpercentile(rows.snr_t, [1, 99])
    maps = (
        (rows.snr_t, low_t, high_t, "dB", "SNR_t of every camera pixel", ROWS_READING),
        (
            rows.snr_b_of_frequency,
            low,
            high,
            "dB",
            "SNR_b under every frequency (kx, ky), DC in the middle",
            FREQUENCIES_READING,
        ),
        (q[..., 1], 0, width - 1, "px", "Correspondence: projector column", READINGS["column"]),
        (q[..., 0], 0, height - 1, "px", "Correspondence: projector row", READINGS["row"]),
    )
    return "".join(colour_map(*values, reading=reading) for *values, reading in maps)
