"""The report of a reconstruction from photos of a plan."""

from collections.abc import Callable
from html import escape

from nearfar.capture import Capture
from nearfar.decibels import in_figures
from nearfar.markup import numbers
from nearfar.plan import Plan
from nearfar.report.methods import checked_by_photos, reconstruction_methods
from nearfar.report.misfit import misfit_section
from nearfar.report.plan import count_by_sort, describe_window
from nearfar.report.transport_page import Told, displayed, transport_page
from nearfar.transport.stored import StoredTransport
from nearfar.workflow.diagnosis.misfit_maps import MisfitMaps
from nearfar.workflow.verdict.verdict import Verdict

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
    plan = capture.plan
    told = Told(
        f"The light transport of a scene, reconstructed from the photos in "
        f"{escape(capture.path.name)} by the {escape(stored.provenance['method'])} method.",
        f"""{_held_out(verdict)}
{misfit_section(misfit)}
<h2>The plan</h2>
{plan_table(plan)}""",
        reconstruction_methods(
            stored,
            plan,
            checked_by_photos(verdict.held_out),
            correspondence_given=correspondence_given,
        ),
    )
    return transport_page(displayed(stored), capture, verdict.kept, told, reword, command=command)


def _held_out(verdict: Verdict) -> str:
    """Compare the transport with each of the check photos."""
    if verdict.held_out is None:
        return ""

    def written(decibels: float | None) -> str:
        return "" if decibels is None else in_figures(decibels)

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


def plan_table(plan: Plan) -> str:
    """Return a table of a plan's photos, window and far band, as HTML."""
    counts = {PURPOSES[name]: count for name, count in plan.counts.items() if count}
    if plan.is_by_codes:
        counts = count_by_sort(plan)
    rows = [[name, str(count)] for name, count in counts.items()]
    rows.append(["all photos", str(len(plan.patterns))])
    rows.append(["window of near-range light", describe_window(plan.window, plan.pitch)])
    rows.append(["far band", str(plan.far)])
    return numbers(["photos", "number"], rows)
