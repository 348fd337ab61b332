"""A calibration written to a folder: its numbers, and plots of the measurements behind them."""

from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from nearfar.files import new_output
from nearfar.report.figures.style import LINES, new_figure, save, styled
from nearfar.rigs.calibration import CALIBRATION_NAME
from nearfar.workflow.calibrate import Findings

# Label, colour and line style; the colours also differ in lightness, for prints in grey.
PRIMARIES = (("red", "#8c1c13", "-"), ("green", "#3f9e74", "--"), ("blue", "#1f4e9c", "-."))
INK = "#111111"


def write_calibration(folder: Path, findings: Findings, *, force: bool = False) -> None:
    """Write calibration.json and plots of the measurements behind it, completely or not at all.

    Parameters
    ----------
    folder : Path
        Folder to create.
    findings : Findings
    force : bool
        Whether to replace an existing calibration.

    Raises
    ------
    ExistingOutputError, MissingFileError, StorageError
        As `nearfar.files.new_output`.
    """
    with new_output(folder, force=force, replaceable=is_calibration) as partial:
        partial.mkdir()
        (partial / CALIBRATION_NAME).write_text(
            findings.calibration.model_dump_json(indent=1), encoding="utf-8"
        )
        with styled():
            projector, camera = _projector(findings), _camera(findings)
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
        f"half of white's light at level {half} of 255; linearised to "
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
    """Return whether a folder may be replaced by a calibration: it is one, or it is empty."""
    try:
        names = {entry.name for entry in folder.iterdir()}
    except OSError:
        return False
    return not names or CALIBRATION_NAME in names


def _projector(findings: Findings) -> Figure:
    figure = new_figure(2.6)
    response, residual = figure.subplots(1, 2)
    table = findings.calibration.response_table()
    is_grey = bool((table == table[:, :1]).all())
    lines = [("all primaries", INK, "-")] if is_grey else PRIMARIES
    for i, (name, colour, style) in enumerate(lines):
        response.plot(table[:, i], color=colour, linestyle=style, label=name)
    for channel in findings.light.T:
        response.plot(findings.levels, channel, "o", markersize=2.5, color="#888888")
    response.set(xlabel="level", ylabel="light over white's", title="response and its ramp")
    response.legend()
    level, light = findings.checked.T
    residual.axhline(0, color="#888888", linewidth=0.6)
    residual.plot(255 * level, 100 * (light - level), "o-", markersize=3, color=INK)
    residual.set(
        xlabel="level", ylabel="error, % of white", title="the linearised ramp, less a line"
    )
    _widen_y(residual, 1.0)
    return figure


def _camera(findings: Findings) -> Figure:
    figure = new_figure(2.6)
    line, noise = figure.subplots(1, 2)
    if len(findings.exposures):
        seconds, levels = findings.exposures.T
        rate = np.polyfit(seconds, levels, 1)
        line.plot(1e3 * seconds, levels, "o", markersize=3, color=INK)
        span = np.array([0.0, seconds.max()])
        line.plot(1e3 * span, np.polyval(rate, span), **LINES["D"])
    else:
        line.text(0.5, 0.5, "the exposure cannot be set", ha="center", transform=line.transAxes)
    line.set(xlabel="exposure, ms", ylabel="mean level", title="the camera's own line")
    means, variances = findings.noise.T
    noise.plot(means, variances, ".", markersize=2, color="#888888", label="pairs of photos")
    span = np.linspace(means.min(), means.max(), 50)
    noise.plot(span, findings.calibration.sensor.variance(span), **LINES["N"], label="fit")
    noise.set(xlabel="mean level", ylabel="variance, levels²", title="noise")
    noise.legend()
    return figure


def _widen_y(axes: Axes, half_range: float) -> None:
    """Extend the y axis to at least +-`half_range`, so that small residuals look small."""
    low, high = axes.get_ylim()
    axes.set_ylim(min(low, -half_range), max(high, half_range))
