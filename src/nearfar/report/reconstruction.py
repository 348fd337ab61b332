"""The report of a reconstruction: pictures, maps, error bars, and its provenance."""

import json
from collections.abc import Callable, Iterator, Mapping
from html import escape
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from nearfar.arrays import Floats
from nearfar.capture import Capture
from nearfar.faults.of_capture import find_faults
from nearfar.illumination.pictures import natural_picture, white
from nearfar.markup import numbers, picture
from nearfar.plan import Plan
from nearfar.report.figures.style import new_figure, styled
from nearfar.report.maps import TITLES, Map, maps_of
from nearfar.report.methods import checked_by_photos, counted, reconstruction_methods
from nearfar.report.misfit import misfit_section
from nearfar.report.page import colour_map, facts, gallery, listed, page, plot, verdict_box
from nearfar.report.plan import describe_window
from nearfar.transport.model import Transport
from nearfar.transport.stored import StoredTransport
from nearfar.workflow.diagnosis.misfit_maps import MisfitMaps
from nearfar.workflow.verdict.verdict import Verdict

# Larger cameras are displayed at every second row and column, every third, and so on.
MAXIMUM_DISPLAYED_PIXELS = 2**17
HISTOGRAM_READING = (
    "How many camera pixels are how sure. The further to the right, the better; a hump at the left "
    "is of dark surfaces, which few photons reach. Saturated camera pixels are left out."
)
PURPOSES = {
    "direct": "direct light: the checkerboard",
    "near": "near-range light",
    "far": "far-range light",
    "reference": "white and black, to measure against",
    "correspondence": "which projector pixel lights which camera pixel",
    "check": "pictures to check relighting by",
}


def reconstruction_page(
    stored: StoredTransport,
    capture: Capture,
    verdict: Verdict,
    reword: Callable[[str], str] = str,
    *,
    misfit: MisfitMaps | None = None,
    correspondence_given: bool = False,
    command: str | None = None,
) -> str:
    """Return the report of a transport as one self-contained HTML page.

    Parameters
    ----------
    stored : StoredTransport
    capture : Capture
        The capture that it was reconstructed from.
    verdict : Verdict
        On the transport.
    reword : callable, optional
        Rewords a fault, such as for readers who use the command line.
    misfit : MisfitMaps, optional
        Where photos and relit pictures differ, as
        `nearfar.workflow.diagnosis.misfit_maps.measure_misfit` returns it.
    correspondence_given : bool
        Whether q was given, and not found in the photos.
    command : str, optional
        As `nearfar.report.page.page` takes it.

    Raises
    ------
    UnreadableFileError
        If the transport is damaged.
    """
    step = int(np.ceil(np.sqrt(stored.camera.pixels / MAXIMUM_DISPLAYED_PIXELS)))
    transport = stored.thinned(step)
    exposure = exposure_of(transport)
    maps = {name: compute() for name, compute in maps_of(transport).items()}
    snr = maps.get("picture-error", maps.get("noise"))
    assert snr is not None
    finite = snr.values[np.isfinite(snr.values)]
    median = f"{np.median(finite):.1f} dB" if finite.size else "none"
    plan = capture.plan
    cards = facts(
        [
            *_relit_pictures(verdict),
            (str(len(plan.patterns)), "photos"),
            (
                f"{plan.projector.pixels / len(plan.patterns):.1f}×",
                "fewer photos than by brute force, all counted",
            ),
            (str(stored.camera), f"camera pixels, {counted(stored.channels, 'channel')}"),
            (str(stored.projector), "projector pixels"),
            (f"{transport.lit.mean():.1%}", "of camera pixels see direct light"),
            (median, f"{snr.title}, median"),
            *_saturated(transport),
        ]
    )
    faults = [*map(str, find_faults(capture, stored.provenance)), *capture.alarms]
    faults = [reword(fault) for fault in faults]
    thinned = "" if step == 1 else f" One in {step} of the camera's rows and columns is shown."
    body = f"""
<h1>{escape(stored.path.name)}</h1>
<p>The light transport of a scene, reconstructed from the photos in
{escape(capture.path.name)} by the {escape(stored.provenance["method"])} method.{thinned}</p>
{verdict_box(verdict.grade, str(verdict).partition(": ")[2])}
{cards}
{f"<h2>What to look at</h2>{listed(faults)}" if faults else ""}
<h2>Relit, and taken apart</h2>
<p>Direct light comes from one projector pixel, near-range light from the window around it,
far-range light from everywhere; together they are the relit picture. {_exposure_note(exposure)}</p>
{gallery(["light", "direct", "near-range", "far-range", "relit"], _rows(transport, exposure))}
<h2>Maps</h2>
<p>Grey where there is no value, such as where no direct light is seen.</p>
<div class="maps">{"".join(_map(each) for each in maps.values())}</div>
<h2>How sure</h2>
<p>{_explain(snr)}</p>
{plot(_histogram(snr), "histogram of " + snr.title, HISTOGRAM_READING)}
{_held_out(verdict)}
{misfit_section(misfit)}
<h2>The plan</h2>
{_plan_table(plan)}
<h2>Where it comes from</h2>
{numbers(["what", "value"], _provenance(stored, capture))}
"""
    methods = reconstruction_methods(
        stored,
        plan,
        checked_by_photos(verdict.held_out),
        correspondence_given=correspondence_given,
    )
    return page(f"nearfar: {stored.path.name}", body, methods=methods, command=command)


def _relit_pictures(verdict: Verdict) -> list[tuple[str, str]]:
    """Return the cards of relit pictures, which lead."""
    if verdict.held_out is None:
        return []
    expected = verdict.held_out.expected_snr
    beside = "" if expected is None else f"; {expected:.1f} dB expected"
    if verdict.planned_snr is not None:
        beside += "; planned for {:.0f} to {:.0f} dB".format(*verdict.planned_snr)
    least = "at least " if verdict.held_out.is_least else ""
    lights = f"{verdict.held_out.called} no estimate saw"
    return [(f"{least}{verdict.held_out.snr:.1f} dB", f"held-out SNR_b: {lights}{beside}")]


def _saturated(transport: Transport) -> list[tuple[str, str]]:
    """Return the card of saturated camera pixels, if there are some."""
    if transport.quality is None or not transport.quality.saturated.any():
        return []
    share = transport.quality.saturated.mean()
    return [(f"{share:.1%}", "of camera pixels are saturated: marked, with unknown errors")]


def _held_out(verdict: Verdict) -> str:
    """Compare the transport with each of the check photos."""
    if verdict.held_out is None:
        return ""

    def written(decibels: float | None) -> str:
        return "" if decibels is None else f"{decibels:.1f}"

    fine = verdict.held_out.fine
    rows = [
        [
            light.description.removesuffix(" to check by") + ", fine" * (light in fine),
            written(light.snr),
            written(light.expected_snr),
            written(light.noise_snr),
            written(light.photo_snr),
        ]
        for light in (*verdict.held_out.lights, *fine)
    ]
    head = ["light", "held-out SNR_b", "expected", "noise alone allows", "one photo over its noise"]
    return f"""<h2>Checked</h2>
<p>The transport was relit under patterns from whose photos no response was estimated, and compared
with these photos; all in dB. Where it is much worse than expected, the scene or the photos break an
assumption.</p>
{numbers(head, rows)}
"""


def exposure_of(transport: Transport) -> float:
    """Return the gain, a power of 2, that makes the floodlit picture bright."""
    brightest = float(np.percentile(transport @ white(transport.projector), 99.5))
    return float(2.0 ** np.round(np.log2(0.9 / brightest))) if brightest > 0 else 1.0


def _exposure_note(exposure: float) -> str:
    return "" if exposure == 1 else f"Pictures are shown {exposure:g} times as bright."


def _rows(transport: Transport, exposure: float) -> list[tuple[str, list[str]]]:
    lights = {
        "a picture": natural_picture(transport.projector, 1),
        "white": white(transport.projector),
    }
    rows = []
    for name, light in lights.items():
        parts = transport.components(light)
        images = [*(exposure * part for part in parts), exposure * sum(parts)]
        names = ["direct", "near-range", "far-range", "relit"]
        cells = [picture(light, f"light: {name}")]
        for image, part in zip(images, names, strict=True):
            cells.append(picture(visible(np.asarray(image)), f"{part} under {name}"))
        rows.append((name, cells))
    return rows


def visible(image: Floats) -> Floats:
    """Reduce a picture of any number of channels to 1 or 3: the first three, or their mean."""
    if image.ndim == 2 or image.shape[2] == 3:
        return image
    return image[..., :3] if image.shape[2] > 3 else image.mean(axis=-1)


def _explain(snr: Map) -> str:
    """Describe the histogram in words."""
    if snr.title == TITLES["picture-error"]:
        return (
            "Signal over one standard deviation, under a natural picture, of every camera pixel: "
            "20 dB is an error of 10 %, 40 dB of 1 %, 60 dB of 0.1 %. It is of relit pictures; how "
            "light is split into direct, near and far is less sure."
        )
    return (
        "Light under white over the noise of one measurement. Only the joint estimate has "
        "error bars."
    )


def _map(each: Map) -> str:
    return colour_map(
        each.values,
        each.low,
        each.high,
        each.unit,
        each.title,
        reading=each.reading,
        saturated=each.saturated,
    )


def _histogram(each: Map) -> Figure:
    with styled():
        figure = new_figure(2.2)
        axes = figure.subplots()
        axes.hist(each.values[np.isfinite(each.values)], bins=60, color="#1f4e9c")
        axes.set(xlabel=f"{each.title}, {each.unit}", ylabel="camera pixels")
    return figure


def _plan_table(plan: Plan) -> str:
    rows = [[PURPOSES[name], str(count)] for name, count in plan.counts.items() if count]
    rows.append(["all photos", str(len(plan.patterns))])
    rows.append(["window of near-range light", describe_window(plan.window, plan.pitch)])
    rows.append(["far band", str(plan.far)])
    return numbers(["photos", "number"], rows)


def _provenance(stored: StoredTransport, capture: Capture) -> list[list[str]]:
    values: Mapping[str, Any] = {"capture": str(capture.path), **stored.provenance}
    rows = [[name, value] for name, value in _flatten(values) if not name.startswith("plan")]
    seconds = capture.times.max() - capture.times.min() if len(capture.times) else 0.0
    return [*rows, ["taken in", f"{seconds:.0f} s"]]


def _flatten(values: Mapping[str, Any], prefix: str = "") -> Iterator[tuple[str, str]]:
    """Yield nested values as pairs of a full name and a text."""
    for name, value in values.items():
        full_name = f"{prefix}{name}".replace("_", " ")
        if isinstance(value, Mapping):
            yield from _flatten(value, f"{full_name}: ")
        else:
            yield full_name, value if isinstance(value, str) else json.dumps(value)
