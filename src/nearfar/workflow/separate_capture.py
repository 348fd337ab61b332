"""Separate direct from global light in a capture of any patterns, and say what looks wrong."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from nearfar.arrays import Floats, blocks
from nearfar.baselines.separation import Separation, black_over_white_less_black
from nearfar.baselines.separation_by_patterns import Solver, solver
from nearfar.baselines.separation_choice import Choice, choose_patterns
from nearfar.capture import Capture
from nearfar.capture.checks import as_photo, check_photo
from nearfar.errors import InputError
from nearfar.faults.of_capture import find_saturation
from nearfar.files import read_picture
from nearfar.plan.recognition import Recognised, recognise, summarise
from nearfar.plan.recognition.own import recognised_in
from nearfar.progress import Report, ignore_progress
from nearfar.release import version
from nearfar.workflow.pattern_faults import (
    BRIGHTEST_PERCENTILE,
    FAULT_SHARE_OF_LIGHT,
    FAULT_SHARE_OF_PIXELS,
    LEAST_LIGHT,
    SumMisfit,
    deviation,
    mean_around,
    misfit_of,
)

# Values of all photos that are separated at once: some tens of megabytes.
VALUES_AT_ONCE = 1 << 23
# Level of a uniform pattern from which it counts as white.
LEAST_WHITE = 0.9


class Dark(NamedTuple):
    """A photo to subtract from all.

    Attributes
    ----------
    photo : ndarray, shape (Cy, Cx, channels)
        In photo units.
    black_level : float
        Light of a black pixel as a share of a white one's that is left after that: 0 where the
        photo is under black.
    """

    photo: Floats
    black_level: float = 0.0


@dataclass(frozen=True, eq=False)
class SeparatedCapture:
    """Direct and global light, and how they were found.

    Attributes
    ----------
    pictures : Separation
    numbers : dict
        What was used and found, as JSON types.
    used, left_out : list of str
        A line for each group of patterns.
    faults : list of str
        A sentence for each thing that looks wrong.
    """

    pictures: Separation
    numbers: dict[str, Any]
    used: list[str]
    left_out: list[str]
    faults: list[str]


def read_dark(capture: Capture, path: Path, black_level: float = 0.0) -> Dark:
    """Read a photo of ambient light or under black that belongs to a capture.

    Raises
    ------
    MissingFileError, UnreadableFileError
        If it is not there or cannot be read.
    InputError
        If it does not fit the capture's photos, or the black level is outside [0, 1).
    """
    black_over_white_less_black(black_level)
    photo = as_photo(read_picture(path), str(path))
    first = np.asarray(capture.photos[0])
    check_photo(photo, first, capture.full_scale, str(path))
    return Dark(photo.astype(np.float32) / np.float32(capture.full_scale), black_level)


def separate_capture(
    capture: Capture,
    *,
    dark: Dark | None = None,
    period: float | None = None,
    progress: Report = ignore_progress,
) -> SeparatedCapture:
    """Separate direct from global light by whatever patterns of a capture serve.

    Parameters
    ----------
    capture : Capture
        Of any patterns, or of a plan.
    dark : Dark, optional
        By default black is found in the photos, if their patterns tell it.
    period : float, optional
        Period in pixels of the patterns to use; by default the finest.
    progress : callable
        Called with what is done and its share.

    Returns
    -------
    SeparatedCapture

    Raises
    ------
    InputError
        If no patterns separate; the message says why each does not.
    """
    recognised = _recognised(capture, progress)
    choice = choose_patterns(
        recognised,
        capture.pattern,
        period=period,
        progress=lambda share: progress("patterns", share),
    )
    solve = solver(choice, None if dark is None else dark.black_level)
    parts, misfits, peaks = [], [], []
    height, row = (
        capture.camera.height,
        len(choice.photos) * capture.camera.width * capture.channels,
    )
    for rows in blocks(height, max(1, VALUES_AT_ONCE // row)):
        photos = capture.read(choice.photos, rows)
        peaks.append(photos.max(axis=(0, -1)))
        if dark is not None:
            photos -= dark.photo[rows]
        solved = solve(photos)
        parts.append(solved.pictures)
        if solved.residuals is not None:
            misfits.append(deviation(solved.residuals, solved.degrees))
        progress("separating", min(rows.stop, height) / height)
    pictures = Separation(*(np.concatenate(each) for each in zip(*parts, strict=True)))
    misfit = np.concatenate(misfits) if misfits else None
    shares = _shares(pictures, misfit, np.concatenate(peaks))
    return SeparatedCapture(
        pictures,
        _numbers(capture, pictures, choice, shares, dark),
        summarise(_part(recognised, choice.photos)),
        _say_left_out(recognised, choice),
        _faults(capture, choice, solve, dark, shares),
    )


def _recognised(capture: Capture, progress: Report) -> Recognised:
    """Return the recognised contents of the patterns; those of a plan are recognised now."""
    if capture.shown is not None:
        return recognised_in(capture.plan)
    count = len(capture.plan.patterns)
    patterns = (capture.pattern(number) for number in range(count))
    return recognise(patterns, lambda done: progress("recognising", done / count))


def _part(recognised: Recognised, numbers: Sequence[int]) -> Recognised:
    """Return some of the recognised pictures."""
    place = {number: i for i, number in enumerate(numbers)}
    inverses = (recognised.inverse_of[number] for number in numbers)
    return Recognised(
        recognised.size,
        tuple(recognised.contents[number] for number in numbers),
        tuple(None if inverse is None else place.get(inverse) for inverse in inverses),
    )


def _say_left_out(recognised: Recognised, choice: Choice) -> list[str]:
    return [
        f"{line}: {reason}"
        for reason, numbers in choice.left_out.items()
        for line in summarise(_part(recognised, numbers))
    ]


class _Shares(NamedTuple):
    """Shares of the camera pixels that are lit."""

    saturated: float
    negative: float  # global below zero, which is direct above white
    unfitted: SumMisfit | None


def _shares(pictures: Separation, misfit: Floats | None, peaks: Floats) -> _Shares:
    direct, global_ = (picture.sum(axis=-1) for picture in pictures)
    light = direct + global_
    is_lit = light > LEAST_LIGHT * np.percentile(light, BRIGHTEST_PERCENTILE)
    if not is_lit.any():
        raise InputError(
            "the photos show no light of the patterns: check that each is of its pattern, and that "
            "the projector was on."
        )
    # Where there is no global light, noise alone is below zero half of the time.
    around = mean_around(global_ + FAULT_SHARE_OF_LIGHT * light)
    negative = float(np.mean(around[is_lit] < 0))
    saturated = float(np.mean(peaks[is_lit] >= 1.0))
    return _Shares(saturated, negative, None if misfit is None else misfit_of(misfit, light))


def _numbers(
    capture: Capture, pictures: Separation, choice: Choice, shares: _Shares, dark: Dark | None
) -> dict[str, Any]:
    direct, global_ = (float(picture.sum(dtype=np.float64)) for picture in pictures)
    total = direct + global_
    return {
        "pattern": "recognised",
        "capture": str(capture.path),
        "patterns": len(choice.photos),
        "used": list(choice.photos),
        "left_out": {reason: list(numbers) for reason, numbers in choice.left_out.items()},
        "shortest_period": min(each.period for each in choice.structured),
        "axes": [
            name for name, along in zip(("rows", "columns"), choice.axes, strict=True) if along
        ],
        "black_level": None if dark is None else dark.black_level,
        "camera": list(capture.camera),
        "channels": capture.channels,
        "saturated_share": float(capture.saturated[list(choice.photos)].mean()),
        "saturated_pixels": shares.saturated,
        "global_below_zero": shares.negative,
        "not_summing_to_white": None if shares.unfitted is None else shares.unfitted.share,
        "direct_share": direct / total if total > 0 else None,
        "nearfar": version(),
    }


def _faults(
    capture: Capture, choice: Choice, solve: Solver, dark: Dark | None, shares: _Shares
) -> list[str]:
    path = capture.path
    saturated = float(capture.saturated[list(choice.photos)].mean())
    found = list(map(str, find_saturation(str(path), saturated)))
    if shares.saturated > FAULT_SHARE_OF_PIXELS and found:
        found[0] = f"{found[0].removesuffix('.')} (at {shares.saturated:.1%} of the lit pixels)."
    if dark is None and not solve.has_black:
        found.append(
            f"{path} has no photo that tells black, so ambient light and the camera's black level "
            f"count as global: add a photo under black, or give it as `black`."
        )
    if shares.unfitted is not None:
        found += shares.unfitted.warning(path)
    if shares.negative > FAULT_SHARE_OF_PIXELS:
        found.append(_say_negative(choice, shares.negative))
    if choice.unchanging > FAULT_SHARE_OF_PIXELS:
        found.append(
            f"{choice.unchanging:.0%} of the projector's pixels are lit in all patterns used, or "
            f"in none, so that direct light there counts as global: add patterns shifted further."
        )
    down, across = choice.axes
    if down != across and min(capture.plan.projector) > 1:
        same, other = ("row", "columns") if down else ("column", "rows")
        found.append(
            f"the patterns vary along one axis only, so light that comes from other {other} of the "
            f"same {same} counts as direct: add patterns of {other}."
        )
    return found


def _say_negative(choice: Choice, share: float) -> str:
    """Name the causes of negative global light, which is direct light above white."""
    if any(each.mean >= LEAST_WHITE for each in choice.uniform):
        return (
            f"direct light is above white at {share:.0%} of the camera pixels: white is saturated "
            f"or of another exposure, or projector or camera is not linear."
        )
    return (
        f"global light is below zero at {share:.0%} of the camera pixels: the black photo is too "
        f"bright, the patterns' contrast is not that of their files, or projector or camera is not "
        f"linear."
    )
