"""The figures: each with its experiment, its arrays, a function that draws it, and a caption."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial

from matplotlib.figure import Figure

from nearfar.decibels import in_words
from nearfar.report.figures import accuracy, components, rival, spectra, transport_slice
from nearfar.workflow.experiments.data import Data


@dataclass(frozen=True)
class Sheet:
    """A figure.

    Attributes
    ----------
    title : str
    experiments : tuple of str
        Names in `nearfar.workflow.experiments.paper.EXPERIMENTS`, for its data.
    draw : callable
    caption : callable
        Writes the caption from the data.
    arrays : tuple of str
        Prefixes of the names of the arrays that it draws; all arrays if empty.
    """

    title: str
    experiments: tuple[str, ...]
    draw: Callable[[Data], Figure]
    caption: Callable[[Data], str]
    arrays: tuple[str, ...] = ()

    def data_of(self, data: Data) -> Data:
        """Return the part of an experiment's data that the figure draws."""
        chosen = {
            name: values
            for name, values in data.arrays.items()
            if not self.arrays or name.startswith(self.arrays)
        }
        return Data(chosen, data.numbers)


def _acquired(data: Data) -> str:
    plan = data.numbers["plan"]
    return (
        f"W = {data.numbers['window']}, far band {'x'.join(map(str, data.numbers['far']))}: "
        f"{plan['transport_photos']} photos with sensor noise for a transport of "
        f"{plan['brute_force']} projector pixels, {plan['savings']:.1f} times fewer than brute "
        f"force, and {plan['photos']['correspondence']} of stripes for correspondence. Near- and "
        f"far-range light is shown twice as bright."
    )


def _slice(data: Data) -> str:
    off = data.numbers["slice_off"]
    return (
        f"The transport between a row of the camera and the same row of the projector: a dominant "
        f"diagonal with much weaker light beside it, dense, of slowly decaying singular values. "
        f"Entries of 1/1000 to 1/100 of the largest are off by {off['-3']:.0%} (median), those of "
        f"1/10 000 to 1/1000 by {off['-4']:.0%}; the fringes beside the candle are the far band's "
        f"end."
    )


def _spectra(data: Data) -> str:
    ranks = data.numbers["ranks"]
    return (
        f"Direct light is diagonal and of full rank ({ranks['D']}), near-range light a band "
        f"around it ({ranks['N']}), far-range light dense, weak and of low rank ({ranks['F']}). "
        f"Ranks count singular values over {data.numbers['rank_above']:g} of T's largest. k_far "
        f"is the far band's end; k_near, 3/W cycles per pixel, holds {data.numbers['held']:.0%} of "
        f"N's energy. Spectra are of whole rows, slices of one line of the projector."
    )


def _accuracy(data: Data) -> str:
    y, x = data.numbers["lowest_camera_pixel"]
    ky, kx = data.numbers["lowest_frequency"]
    return (
        f"{data.numbers['plan']['transport_photos']} complex patterns without noise; near- and "
        f"far-range light is shown four times as bright. The lowest SNR_b, "
        f"{in_words(data.numbers['snr_b_frequency']['p0'])}, is at (kx, ky) = ({kx}, {ky}); the "
        f"lowest SNR_t, {in_words(data.numbers['snr_t']['p0'])}, at camera pixel ({x}, {y})."
    )


def _rival(data: Data) -> str:
    found = data.numbers["CLT"]
    shares = [share for share, _, _ in found["grid"]]
    at_end = " (the grid's end)" if found["share"] == min(shares) else ""
    return (
        f"{found['patterns']} patterns each, without noise; errors are shown brighter. This method "
        f"is given q, as the paper has it from stripes, and its complex patterns hold "
        f"{found['answers_of_this_method']} real responses. Compressive light transport (CLT): "
        f"Bernoulli patterns, rows sparse in the Haar basis, each reconstructed on its own, "
        f"{'refitted by least squares' if found['refitted'] else 'without refitting'}, with the "
        f"lambda that is best against the truth: {found['share']:.1e} of each row's "
        f"largest{at_end}, of {len(shares)} tried."
    )


SHEETS: Mapping[str, Sheet] = {
    "1": Sheet(
        "A slice of the transport",
        ("box",),
        transport_slice.draw,
        _slice,
        ("white/exact", "slice"),
    ),
    "2": Sheet(
        "A box with a candle, taken apart",
        ("box",),
        partial(components.draw, picture="penguin"),
        _acquired,
        ("white/", "picture/"),
    ),
    "3": Sheet("Components in space and frequency", ("scan-line",), spectra.draw, _spectra),
    "4": Sheet(
        "A corner",
        ("corner",),
        partial(components.draw, picture="landscape"),
        _acquired,
        ("white/", "picture/"),
    ),
    "5": Sheet(
        "Accuracy at every frequency and camera pixel",
        ("wedge",),
        accuracy.draw,
        _accuracy,
        ("white/", "picture/", "snr"),
    ),
    "6": Sheet("Against compressive light transport", ("wedge", "CLT"), rival.draw, _rival),
}
