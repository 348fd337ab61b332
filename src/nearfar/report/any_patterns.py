"""The report of a reconstruction from anybody's patterns, or of free rows."""

from collections.abc import Callable
from html import escape

import numpy as np

from nearfar.arrays import middles
from nearfar.capture import Capture
from nearfar.decibels import in_figures
from nearfar.markup import numbers
from nearfar.plan import Plan
from nearfar.progress import Report, ignore_progress
from nearfar.report.beside import pictures_beside
from nearfar.report.methods import any_patterns_methods
from nearfar.report.page import listed
from nearfar.report.plan import describe_plan
from nearfar.report.transport_page import Displayed, Told, displayed, transport_page
from nearfar.transport.stored import StoredTransport
from nearfar.workflow.judge import Pair
from nearfar.workflow.verdict.checked import CheckedLight, Judged

# Held-out photos that are shown, and rows of the table of all of them.
MOST_SHOWN = 4
MOST_LISTED = 20


def any_patterns_page(
    stored: StoredTransport,
    capture: Capture,
    judged: Judged,
    reword: Callable[[str], str] = str,
    *,
    correspondence_given: bool = False,
    command: str | None = None,
    progress: Report = ignore_progress,
) -> str:
    """Return the report of a transport from anybody's patterns, or of free rows.

    What it shares with that of a plan is `nearfar.report.transport_page`; what measured frequencies
    would tell is left out.

    Parameters
    ----------
    stored : StoredTransport
    capture : Capture
        The capture that it was reconstructed from.
    judged : Judged
        The verdict on the transport, and the photos by which.
    reword, command, progress
        As `nearfar.report.transport_page.transport_page` takes them.
    correspondence_given : bool
        Whether q was given, and not found in the photos.

    Raises
    ------
    UnreadableFileError
        If the transport or the capture is damaged.
    """
    shown = displayed(stored)
    how = ""
    if "free" in stored.parts:
        how = ", as free rows: light from each lamp at each camera pixel is a number of its own"
    told = Told(
        f"The light transport of a scene, reconstructed from photos of known patterns in "
        f"{escape(capture.path.name)}{how}.",
        f"""{_checked(shown, capture, judged)}
{_patterns(capture.plan)}""",
        any_patterns_methods(
            stored, capture.plan, judged.verdict, correspondence_given=correspondence_given
        ),
    )
    return transport_page(
        shown, capture, judged.verdict, told, reword, command=command, progress=progress
    )


def _patterns(plan: Plan) -> str:
    """Return the section of what was shown, or what it was recognised as."""
    first, *lines = describe_plan(plan).splitlines()
    recognised = "What the patterns were recognised as: " if plan.offset == "shown" else ""
    return f"""<h2>The patterns</h2>
<p>{escape(f"{recognised}{first}")}</p>
{listed(lines)}"""


def _checked(shown: Displayed, capture: Capture, judged: Judged) -> str:
    """Return the section of held-out photos; none if nothing was checked."""
    if not judged.lights:
        return ""
    some = judged.lights[:: -(-len(judged.lights) // MOST_LISTED)]
    rows = [
        [_name(capture, light), _decibels(light.snr), _decibels(light.expected_snr)]
        for light in some
    ]
    left_out = len(judged.lights) - len(some)
    more = f" {left_out} more are not listed." if left_out else ""
    return f"""<h2>Checked</h2>
<p>A sample of the camera pixels was estimated without these photos, and what it foretells was
compared with them; all in dB, and no higher than the noise of the one photo can tell. Where that is
much worse than expected, the scene or the photos break an assumption.{more}</p>
{numbers(["photo", "held-out SNR_b", "expected"], rows)}
<p></p>
{_beside(shown, capture, judged)}
"""


def _beside(shown: Displayed, capture: Capture, judged: Judged) -> str:
    """Return relit pictures beside some of the held-out photos."""
    lights = judged.lights[:: -(-len(judged.lights) // MOST_SHOWN)]
    is_unseen = all(capture.plan.patterns[light.photo].purpose == "check" for light in lights)
    seen = (
        "No estimate used them."
        if is_unseen
        else "The transport as a whole was estimated from all photos, these among them, and the "
        "pictures are its own: they show where light is off, and the figures above how far."
    )
    chosen = np.ix_(*(middles(side, shown.step) for side in capture.camera))
    transport = shown.transport
    pairs = {}
    for light in lights:
        pattern = capture.pattern(light.photo)
        photo = capture.read([light.photo])[0][chosen] - transport.black
        flat = photo.reshape(transport.camera.pixels, transport.channels)
        pairs[_name(capture, light)] = Pair(pattern, transport @ pattern, transport.picture(flat))
    return f"""<p>Relit pictures beside held-out photos, less black. {seen}</p>
{pictures_beside(pairs, shown.exposure, "photo")}"""


def _name(capture: Capture, light: CheckedLight) -> str:
    return f"{light.photo}: {capture.plan.patterns[light.photo].description}"


def _decibels(value: float | None) -> str:
    return "" if value is None or not np.isfinite(value) else in_figures(value)
