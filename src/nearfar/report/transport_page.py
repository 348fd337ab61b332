"""What the reports of all transports share: verdict, pictures, maps, error bars and provenance."""

import json
from collections.abc import Callable, Iterator, Mapping
from html import escape
from typing import Any, NamedTuple

import numpy as np
from matplotlib.figure import Figure

from nearfar.arrays import Floats
from nearfar.capture import Capture
from nearfar.decibels import in_words
from nearfar.faults.of_capture import find_faults
from nearfar.illumination.pictures import natural_picture, white
from nearfar.markup import numbers, picture
from nearfar.progress import Report, ignore_progress
from nearfar.report.about import Methods
from nearfar.report.figures.style import new_figure, styled
from nearfar.report.maps import TITLES, Map, maps_of
from nearfar.report.methods import counted
from nearfar.report.page import colour_map, facts, gallery, listed, page, plot, verdict_box
from nearfar.transport.model import Transport
from nearfar.transport.parts import Part
from nearfar.transport.stored import StoredTransport
from nearfar.transport.verdict import KeptVerdict

# Larger cameras are displayed at every second row and column, every third, and so on.
MAXIMUM_DISPLAYED_PIXELS = 2**17
HISTOGRAM_READING = (
    "How many camera pixels are how sure. The further to the right, the better; a hump at the left "
    "is of dark surfaces, which few photons reach. Saturated camera pixels are left out."
)
# What the parts of a transport are called, and where their light comes from.
NAMES: Mapping[Part, str] = {
    "direct": "direct",
    "near": "near-range",
    "far": "far-range",
    "free": "free rows",
}
SOURCES: Mapping[Part, str] = {
    "direct": "direct light comes from one projector pixel",
    "near": "near-range light from the window around it",
    "far": "far-range light from everywhere",
    "free": "free rows hold light from each lamp, whichever its neighbours are",
}


class Displayed(NamedTuple):
    """A transport in a file, and what is displayed of it.

    Attributes
    ----------
    stored : StoredTransport
    transport : Transport
        At some rows and columns of the camera.
    step : int
        One in so many.
    exposure : float
        Gain at which its pictures are shown.
    """

    stored: StoredTransport
    transport: Transport
    step: int
    exposure: float


class Told(NamedTuple):
    """What a page tells that depends on how a transport was reconstructed, as HTML.

    Attributes
    ----------
    made : str
        What it was reconstructed from, and how, a sentence.
    further : str
        Sections before that on where it comes from.
    methods : Methods
    """

    made: str
    further: str
    methods: Methods


def displayed(stored: StoredTransport) -> Displayed:
    """Read what is displayed of a transport.

    Raises
    ------
    UnreadableFileError
        If the transport is damaged.
    """
    step = int(np.ceil(np.sqrt(stored.camera.pixels / MAXIMUM_DISPLAYED_PIXELS)))
    transport = stored.thinned(step)
    return Displayed(stored, transport, step, exposure_of(transport))


def transport_page(
    shown: Displayed,
    capture: Capture,
    verdict: KeptVerdict,
    told: Told,
    reword: Callable[[str], str] = str,
    *,
    command: str | None = None,
    progress: Report = ignore_progress,
) -> str:
    """Return the report of a transport as one self-contained HTML page.

    Parameters
    ----------
    shown : Displayed
    capture : Capture
        The capture that it was reconstructed from.
    verdict : KeptVerdict
        On the transport.
    told : Told
    reword : callable, optional
        Rewords a fault, such as for readers who use the command line.
    command : str, optional
        As `nearfar.report.page.page` takes it.
    progress : callable
        Called with the step and the share of it that is done.
    """
    stored, transport, exposure = shown.stored, shown.transport, shown.exposure
    maps: dict[str, Map] = {}
    computations = maps_of(transport)
    for number, (name, compute) in enumerate(computations.items()):
        found = compute()
        # Such as q where no camera pixel sees direct light.
        if np.isfinite(found.values).any():
            maps[name] = found
        progress("maps", (number + 1) / len(computations))
    snr = maps.get("picture-error", maps.get("noise"))
    photos = len(capture.plan.patterns)
    fewer = stored.projector.pixels / photos
    cards = facts(
        [
            *_relit_pictures(verdict),
            (str(photos), "photos"),
            *(
                [(f"{fewer:.1f}×", "fewer photos than by brute force, all counted")]
                if fewer >= 1
                else []
            ),
            (str(stored.camera), f"camera pixels, {counted(stored.channels, 'channel')}"),
            (str(stored.projector), "lamps" if "free" in stored.parts else "projector pixels"),
            (f"{transport.lit.mean():.1%}", "of camera pixels see direct light"),
            *([] if snr is None else [(_median(snr), f"{snr.title}, median")]),
            *_saturated(transport),
        ]
    )
    faults = [*map(str, find_faults(capture, stored.provenance)), *capture.alarms]
    faults = [reword(fault) for fault in faults]
    thinned = "" if shown.step == 1 else f" {_thinned(shown.step)}"
    body = f"""
<h1>{escape(stored.path.name)}</h1>
<p>{told.made}{thinned}</p>
{kept_verdict_box(verdict)}
{cards}
{f"<h2>What to look at</h2>{listed(faults)}" if faults else ""}
<h2>Relit, and taken apart</h2>
<p>{_sources(transport)} {_exposure_note(exposure)}</p>
{gallery(["light", *_names(transport), "relit"], _rows(transport, exposure))}
<h2>Maps</h2>
<p>Grey where there is no value, such as where no direct light is seen.</p>
<div class="maps">{"".join(_map(each, shown.step) for each in maps.values())}</div>
{_how_sure(snr)}
{told.further}
<h2>Where it comes from</h2>
{numbers(["what", "value"], _provenance(stored, capture))}
"""
    return page(f"nearfar: {stored.path.name}", body, methods=told.methods, command=command)


def kept_verdict_box(verdict: KeptVerdict) -> str:
    """Return the verdict on a transport as HTML."""
    return verdict_box(verdict.grade, str(verdict).partition(": ")[2])


def _thinned(step: int) -> str:
    return f"One in {step} of the camera's rows and columns is shown."


def _median(snr: Map) -> str:
    finite = snr.values[np.isfinite(snr.values)]
    return in_words(float(np.median(finite))) if finite.size else "none"


def _relit_pictures(verdict: KeptVerdict) -> list[tuple[str, str]]:
    """Return the cards of relit pictures, which lead."""
    if verdict.held_out_snr is None:
        return []
    beside = "" if verdict.expected_snr is None else f"; {verdict.expected_snr:.1f} dB expected"
    if verdict.planned_snr is not None:
        beside += "; planned for {:.0f} to {:.0f} dB".format(*verdict.planned_snr)
    least = "at least " if verdict.is_least else ""
    lights = f"{verdict.checked_by} no estimate saw"
    return [(f"{least}{in_words(verdict.held_out_snr)}", f"held-out SNR_b: {lights}{beside}")]


def _saturated(transport: Transport) -> list[tuple[str, str]]:
    """Return the card of saturated camera pixels, if there are some."""
    if transport.quality is None or not transport.quality.saturated.any():
        return []
    share = transport.quality.saturated.mean()
    return [(f"{share:.1%}", "of camera pixels are saturated: marked, with unknown errors")]


def exposure_of(transport: Transport) -> float:
    """Return the gain, a power of 2, that makes the floodlit picture bright."""
    brightest = float(np.percentile(transport @ white(transport.projector), 99.5))
    return float(2.0 ** np.round(np.log2(0.9 / brightest))) if brightest > 0 else 1.0


def _exposure_note(exposure: float) -> str:
    return "" if exposure == 1 else f"Pictures are shown {exposure:g} times as bright."


def _names(transport: Transport) -> list[str]:
    return [NAMES[part] for part in transport.parts]


def _sources(transport: Transport) -> str:
    sources = [SOURCES[part] for part in transport.parts]
    together = "; together they are the relit picture" if len(sources) > 1 else ""
    whose = " These are parts of the model's split, not of the physical one." * (
        "near" in transport.parts
    )
    text = f"{', '.join(sources)}{together}.{whose}"
    return text[0].upper() + text[1:]


def _rows(transport: Transport, exposure: float) -> list[tuple[str, list[str]]]:
    lights = {
        "a picture": natural_picture(transport.projector, 1),
        "white": white(transport.projector),
    }
    rows = []
    for name, light in lights.items():
        components = transport.components(light)
        parts = transport.named(components).values()
        images = [*(exposure * part for part in parts), exposure * sum(components)]
        names = [*_names(transport), "relit"]
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


def _how_sure(snr: Map | None) -> str:
    """Return the section of error bars; none where nothing is known of them."""
    if snr is None:
        return ""
    return f"""<h2>How sure</h2>
<p>{_explain(snr)}</p>
{plot(_histogram(snr), "histogram of " + snr.title, HISTOGRAM_READING)}"""


def _explain(snr: Map) -> str:
    """Describe the histogram in words."""
    if snr.title == TITLES["picture-error"]:
        return (
            "Signal over one standard deviation, under a natural picture, of every camera pixel: "
            "20 dB is an error of 10 %, 40 dB of 1 %, 60 dB of 0.1 %. It is of relit pictures; how "
            "light is split into parts is less sure."
        )
    return (
        "Light under white over the noise of one measurement. Only the joint estimate has "
        "error bars."
    )


def _map(each: Map, step: int) -> str:
    return colour_map(
        each.values,
        each.low,
        each.high,
        each.unit,
        each.title,
        reading=each.reading,
        saturated=each.saturated,
        step=step,
    )


def _histogram(each: Map) -> Figure:
    with styled():
        figure = new_figure(2.2)
        axes = figure.subplots()
        axes.hist(each.values[np.isfinite(each.values)], bins=60, color="#1f4e9c")
        axes.set(xlabel=f"{each.title}, {each.unit}", ylabel="camera pixels")
    return figure


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
