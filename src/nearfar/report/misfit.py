"""The part of a report that shows how well the photos fit the transport that was made of them."""

import numpy as np
from matplotlib.figure import Figure

from nearfar.report.figures.style import SEQUENTIAL, new_figure, styled
from nearfar.report.page import colour_map, plot
from nearfar.workflow.diagnosis.misfit_maps import MisfitMaps

# The colour scales end here at least, so that a good capture does not look bad.
LEAST_END = 4.0


def misfit_section(misfit: MisfitMaps | None) -> str:
    """Return the section of a report, or a sentence on why there is none."""
    title = "<h2>How well the photos fit</h2>"
    if misfit is None:
        return (
            f"{title}<p>Not known: the photos of this plan, or the rows of a square T, do not tell "
            f"their noise photo by photo.</p>"
        )
    checks = ""
    if misfit.of_checks is not None:
        checks = (
            f" Check photos, which no estimate used, have {misfit.of_checks:.1f}; the error of "
            f"relighting counts there too."
        )
    finite = misfit.of_camera[np.isfinite(misfit.of_camera) & ~misfit.saturated]
    high = max(LEAST_END, float(np.percentile(finite, 99))) if finite.size else LEAST_END
    cell = "" if misfit.cell == 1 else f" A cell is about {misfit.cell} camera pixels wide."
    values = np.where(misfit.saturated, np.nan, misfit.of_camera).astype(np.float32)
    where = colour_map(
        values,
        0.0,
        high,
        "",
        "misfit over the camera",
        reading="A bright patch holds something that moved, or light that the model does not hold, "
        f"such as a mirror's; stripes all over come from single bad photos.{cell}",
        saturated=misfit.saturated,
        step=misfit.cell,
    )
    by_frequency = ""
    # Codes show all frequencies at once.
    if misfit.of_frequencies:
        by_frequency = plot(
            _by_frequency(misfit),
            "misfit by frequency",
            "Each dot is a frequency that was photographed, drawn twice as k and -k; coarse "
            "stripes are in the middle, fine ones outside. Single bright dots are single bad "
            "photos; a bright ring or middle is light of a kind that the model does not hold.",
        )
    return f"""{title}
<p>Each photo is compared with the relit picture of its pattern. Misfit is the squared difference
over what noise makes of it: about 1, or somewhat less, where all is well.{checks}</p>
<div class="beside">{by_frequency}{where}</div>
"""


def _by_frequency(misfit: MisfitMaps) -> Figure:
    frequencies = np.array([[float(part) for part in k] for k in misfit.of_frequencies])
    values = np.array(list(misfit.of_frequencies.values()))
    with styled():
        figure = new_figure(4.2, width=5.2)
        axes = figure.subplots()
        ky, kx = np.concatenate([frequencies, -frequencies]).T
        # The worst are drawn last, on top.
        order = np.argsort(np.tile(values, 2))
        dots = axes.scatter(
            kx[order],
            ky[order],
            c=np.tile(values, 2)[order],
            cmap=SEQUENTIAL,
            vmin=0.0,
            vmax=max(LEAST_END, float(values.max(initial=0.0))),
            s=26,
            linewidths=0.3,
            edgecolors="#444444",
        )
        axes.set(
            xlabel="frequency across, cycles per projector pixel",
            ylabel="frequency down",
            aspect="equal",
        )
        axes.invert_yaxis()
        figure.colorbar(dots, ax=axes, label="misfit; noise alone makes 1")
    return figure
