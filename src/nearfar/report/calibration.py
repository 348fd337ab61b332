"""A calibration on the disk: its numbers and its plots."""

from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from nearfar.files import new_output
from nearfar.report.figures.style import LINES, new_figure, save, styled
from nearfar.rigs.calibration import NAME
from nearfar.workflow.calibrate import Findings

# Colours of red, green and blue that differ in lightness, too.
PRIMARIES = (("red", "#8c1c13", "-"), ("green", "#3f9e74", "--"), ("blue", "#1f4e9c", "-."))


def write_calibration(folder: Path, found: Findings, *, force: bool = False) -> None:
    """Write calibration.json and plots of what it was read from, whole or not at all.

    Parameters
    ----------
    folder : Path
        To make.
    found : Findings
    force : bool
        Replace a calibration that is there.

    Raises
    ------
    ExistingOutputError, MissingFileError, StorageError
        As `nearfar.files.new_output`.
    """
    with new_output(folder, force=force, replaceable=is_calibration) as partial:
        partial.mkdir()
        (partial / NAME).write_text(found.calibration.model_dump_json(indent=1), encoding="utf-8")
        with styled():
            projector, camera = _projector(found), _camera(found)
        save(projector, partial, "projector")
        save(camera, partial, "camera")


def describe_calibration(found: Findings) -> str:
    """Return in lines what a calibration found.

    Parameters
    ----------
    found : Findings

    Returns
    -------
    str
    """
    known = found.calibration
    half = sum(row[0] < 0.5 for row in known.response)
    lines = [
        f"half of white's light at level {half} of 255; straightened to "
        f"{known.residual:.2%} of white",
        f"red, green and blue together: {1 + known.superposition:.1%} of white",
        f"camera: black level {known.black:.4g}, {known.gain:.4g} levels an electron, read noise "
        f"{known.read:.3g} levels",
        f"light under black: {known.ambient:.2%} of full scale",
    ]
    if known.exposure is not None:
        lines.append(f"exposure {known.exposure:.4g} s")
    if known.linearity is not None:
        lines.append(f"camera linear to {known.linearity:.2%} of full scale")
    return "\n".join(lines)


def is_calibration(folder: Path) -> bool:
    """Tell whether a folder may be replaced by a calibration: it is one, or empty."""
    try:
        names = {entry.name for entry in folder.iterdir()}
    except OSError:
        return False
    return not names or NAME in names


def _projector(found: Findings) -> Figure:
    figure = new_figure(2.6)
    response, straight = figure.subplots(1, 2)
    table = found.calibration.response_table()
    same = bool((table == table[:, :1]).all())
    lines = [("all primaries", "#111111", "-")] if same else PRIMARIES
    for i, (name, colour, style) in enumerate(lines):
        response.plot(table[:, i], color=colour, linestyle=style, label=name)
    for channel in found.light.T:
        response.plot(found.levels, channel, "o", markersize=2.5, color="#888888")
    response.set(xlabel="level", ylabel="light over white's", title="response and its ramp")
    response.legend()
    level, light = found.checked.T
    straight.axhline(0, color="#888888", linewidth=0.6)
    straight.plot(255 * level, 100 * (light - level), "o-", markersize=3, **_ink())
    straight.set(
        xlabel="level", ylabel="error, % of white", title="the straightened ramp, less a line"
    )
    _room(straight, 1.0)
    return figure


def _camera(found: Findings) -> Figure:
    figure = new_figure(2.6)
    line, noise = figure.subplots(1, 2)
    if len(found.exposures):
        seconds, levels = found.exposures.T
        rate = np.polyfit(seconds, levels, 1)
        line.plot(1e3 * seconds, levels, "o", markersize=3, color="#111111")
        span = np.array([0.0, seconds.max()])
        line.plot(1e3 * span, np.polyval(rate, span), **LINES["D"])
    else:
        line.text(0.5, 0.5, "the exposure cannot be set", ha="center", transform=line.transAxes)
    line.set(xlabel="exposure, ms", ylabel="mean level", title="the camera's own line")
    means, variances = found.noise.T
    noise.plot(means, variances, ".", markersize=2, color="#888888", label="pairs of photos")
    span = np.linspace(means.min(), means.max(), 50)
    noise.plot(span, found.calibration.sensor.variance(span), **LINES["N"], label="fit")
    noise.set(xlabel="mean level", ylabel="variance, levels²", title="noise")
    noise.legend()
    return figure


def _ink() -> dict[str, str]:
    return {"color": "#111111"}


def _room(axes: Axes, least: float) -> None:
    """Let noise of next to nothing look like next to nothing."""
    low, high = axes.get_ylim()
    axes.set_ylim(min(low, -least), max(high, least))
