"""Separate direct from global light: export the patterns, compare and write the pictures."""

import json
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from nearfar.arrays import Size
from nearfar.baselines.separation import Separation
from nearfar.baselines.separation_methods import Method
from nearfar.baselines.separation_photos import PhotosToSeparate, spread_of_groups
from nearfar.errors import InputError
from nearfar.faults.of_capture import find_saturation
from nearfar.files import encode_png, new_output, write_picture
from nearfar.illumination.frames import FrameLayout, draw_frame, fit_frame
from nearfar.plan.window import default_window
from nearfar.release import version
from nearfar.transport.exact import ExactTransport
from nearfar.transport.known import KnownTransport
from nearfar.transport.model import Transport
from nearfar.workflow.evaluate import snr
from nearfar.workflow.model_fit import split_by_model
from nearfar.workflow.units import find_other_units, nearest_factor

NUMBERS_NAME = "numbers.json"
PICTURE_NAMES = ("direct", "global")
ENDINGS = (".npy", ".exr", ".png")
# Groups of photos should sum to the same light; a difference above this share is a fault.
MAXIMUM_DIFFERENCE_OF_SUMS = 0.05
# Numbers of channels that .exr and .png hold; .npy holds any.
PICTURE_CHANNELS = (1, 3)


def export_to_separate(
    folder: Path,
    method: Method,
    projector: Size,
    *,
    scale: int | None = None,
    native: Size | None = None,
    force: bool = False,
    progress: Callable[[int], None] | None = None,
) -> FrameLayout:
    """Write ``pattern-00000.png`` and so on, the last one black, and the method beside them.

    Parameters
    ----------
    folder : Path
        Folder to make.
    method : Method
        Of patterns that are known.
    projector : Size
        Pattern grid.
    scale, native, force, progress
        As `nearfar.workflow.export.export_patterns`.

    Returns
    -------
    FrameLayout

    Raises
    ------
    InputError
        If the pattern does not fit the projector, or the projector does not fit on `native`.
    NearfarError
        As `nearfar.files.new_output`.
    """
    assert method.draw is not None
    patterns = method.draw(projector)
    layout = fit_frame(projector, scale, native)
    numbers = {
        **method.settings,
        "patterns": len(patterns),
        "projector": list(projector),
        "frame": list(layout.frame),
        "scale": layout.scale,
    }
    with new_output(folder, force=force, replaceable=is_separation) as partial:
        partial.mkdir()
        for number, pattern in enumerate([*patterns, np.zeros_like(patterns[0])]):
            frame = draw_frame(pattern, layout)
            (partial / f"pattern-{number:05d}.png").write_bytes(encode_png(frame))
            if progress is not None:
                progress(number + 1)
        _write_numbers(partial, numbers)
    return layout


def describe_separation(
    found: Separation, taken: PhotosToSeparate, method: Method
) -> dict[str, Any]:
    """Return the method, the photos and the results of the separation, as JSON types."""
    direct, global_ = (float(picture.sum(dtype=np.float64)) for picture in found)
    total = direct + global_
    return {
        **method.settings,
        "patterns": len(taken.photos),
        "dark": taken.dark_shows,
        "black_level": None if taken.dark_shows == "black" else taken.black_level,
        "camera": list(taken.camera),
        "channels": taken.channels,
        "saturated_share": taken.saturated_share,
        "direct_share": direct / total if total > 0 else None,
        "nearfar": version(),
    }


def find_separation_faults(taken: PhotosToSeparate, method: Method, source: str) -> list[str]:
    """Find what is wrong with photos to separate.

    Parameters
    ----------
    taken : PhotosToSeparate
    method : Method
    source : str
        Rig or folder that the photos are from, for the sentences.

    Returns
    -------
    list of str
        A sentence for each fault.
    """
    found = list(map(str, find_saturation(f"the photos of {source}", taken.saturated_share)))
    if taken.dark is None and taken.black_level == 0.0:
        found.append(
            f"the photos of {source} have none under black and none of ambient light, so ambient "
            f"light and the camera's black level count as global: add a photo under black."
        )
    difference = spread_of_groups(taken, method.groups)
    if difference > MAXIMUM_DIFFERENCE_OF_SUMS:
        found.append(
            f"photos of {source} that should sum to one white differ by {difference:.0%}: they may "
            f"be out of order or of other patterns, or the lamp drifts."
        )
    return found


def summarise_separation(numbers: Mapping[str, Any]) -> str:
    """Return in lines what `describe_separation` says, with ``"snr"`` beside it."""
    lines = [
        f"against the {what}: direct {found['direct']:.2f} dB, global {found['global']:.2f} dB"
        for what, found in numbers["snr"].items()
    ]
    share = numbers["direct_share"]
    direct = f", {share:.1%} of the light direct" if share is not None else ""
    return "\n".join([*lines, f"{numbers['patterns']} photos separated{direct}"])


def write_separation(
    folder: Path, found: Separation, numbers: Mapping[str, Any], *, force: bool = False
) -> None:
    """Write direct and global as .npy, .exr and .png, and numbers.json, in a folder.

    More or fewer channels than a picture's go into the .npy alone.

    Raises
    ------
    NearfarError
        As `nearfar.files.new_output`.
    """
    endings = ENDINGS if found.direct.shape[2] in PICTURE_CHANNELS else ENDINGS[:1]
    with new_output(folder, force=force, replaceable=is_separation) as partial:
        partial.mkdir()
        for name, picture in zip(PICTURE_NAMES, found, strict=True):
            for ending in endings:
                write_picture(partial / f"{name}{ending}", picture.astype(np.float32))
        _write_numbers(partial, numbers)


def _write_numbers(folder: Path, numbers: Mapping[str, Any]) -> None:
    text = json.dumps(numbers, indent=2, allow_nan=False)
    (folder / NUMBERS_NAME).write_text(text + "\n", encoding="utf-8")


def is_separation(folder: Path) -> bool:
    """Return whether a folder is empty, or holds pictures or patterns of a separation alone."""
    entries = list(folder.iterdir())
    ours = all(
        entry.name == NUMBERS_NAME
        or (entry.stem in PICTURE_NAMES and entry.suffix in ENDINGS)
        or (entry.name.startswith("pattern-") and entry.suffix == ".png")
        for entry in entries
    )
    # Photos may be named as the patterns that they show; the numbers are ours alone.
    return ours and (not entries or (folder / NUMBERS_NAME).is_file())


class ComparedToTruth(NamedTuple):
    """A separation beside the truth.

    Attributes
    ----------
    snr : dict of str to float
        Of direct and global, dB.
    faults : list of str
        A sentence if the truth is in other units than the rig recorded.
    """

    snr: dict[str, float]
    faults: list[str]


def compare_to_truth(
    found: Separation,
    truth: KnownTransport,
    exposure: float | None = 1.0,
    *,
    name: str = "the truth",
) -> ComparedToTruth:
    """Compare direct and global under full white (global = N + F) with the truth.

    Parameters
    ----------
    found : Separation
    truth : ExactTransport or ExactOperator
        Its components are as physics has them where they are known apart, and else as the model
        with the window and far band of the paper's plans fits them best.
    exposure : float, optional
        Photo units per unit of the truth, as the rig recorded it; fitted to the sum of both
        pictures if None.
    name : str
        What the truth is called in a sentence.

    Returns
    -------
    ComparedToTruth

    Raises
    ------
    InputError
        If the truth holds no light, or its camera or channels differ from those of `found`.
    """
    if isinstance(truth, ExactTransport) and not truth.is_apart:
        window, band = default_model(truth.projector)
        known = Separation(*split_by_model(truth, window, band).floodlit())
    else:
        light = np.ones(truth.projector, dtype=np.float32)
        direct, near, far = truth.component_pictures(light)
        known = Separation(direct, near + far)
    _require_same_sizes(found, known, "truth")

    def snr_at(factor: float) -> dict[str, float]:
        scaled = Separation(*(np.float32(factor) * picture for picture in known))
        return _snr_of(found, scaled, "truth")

    def reached() -> str:
        return ", ".join(f"{part} {value:.1f} dB" for part, value in snr_at(fitted).items())

    ours, theirs = ((pair.direct + pair.global_).astype(np.float64) for pair in (found, known))
    fitted = nearest_factor(theirs, ours)
    if exposure is None:
        return ComparedToTruth(snr_at(fitted), [])
    faults = find_other_units(
        name, fitted=fitted, recorded=exposure, what="the photos are", reached=reached
    )
    return ComparedToTruth(snr_at(exposure), faults)


def default_model(projector: Size) -> tuple[int, Size]:
    """Return the window and the far band by which a dense T is split: those of usual plans."""
    window = default_window(projector)
    # About 0.1 of each side, odd.
    band = Size(*(2 * round(side / 20) + 1 for side in projector))
    return window, Size(*(min(part, side) for part, side in zip(band, projector, strict=True)))


def compare_to_transport(found: Separation, transport: Transport) -> dict[str, float]:
    """SNR of direct and global against a reconstruction's direct, and near and far, pictures, dB.

    Both are in photo units: the photos of both are taken with one exposure.

    Raises
    ------
    InputError
        If its camera or channels differ from those of `found`.
    """
    parts = transport.components(np.ones(transport.projector, dtype=np.float32))
    shape = (*transport.camera, transport.channels)
    direct, global_ = parts.direct.reshape(shape), (parts.near + parts.far).reshape(shape)
    return _snr_of(found, Separation(direct, global_), "transport")


def _snr_of(found: Separation, known: Separation, what: str) -> dict[str, float]:
    _require_same_sizes(found, known, what)
    pairs = zip(PICTURE_NAMES, known, found, strict=True)
    return {name: snr(values, mine) for name, values, mine in pairs}


def _require_same_sizes(found: Separation, known: Separation, what: str) -> None:
    if found.direct.shape != known.direct.shape:
        ours, theirs = (
            f"{Size(*pictures.direct.shape[:2])} with {pictures.direct.shape[2]} channels"
            for pictures in (found, known)
        )
        raise InputError(
            f"the photos are {ours}, the {what}'s camera is {theirs}: compare two of the same "
            f"scene and sizes."
        )
