"""Judge a transport by the truth, or by photos that it never saw."""

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, NamedTuple, TypeVar

import numpy as np

from nearfar.arrays import Floats
from nearfar.errors import InputError, MissingFileError
from nearfar.estimate.physical import split_physically
from nearfar.files import full_scale_of, list_pictures, luminance, read_light, read_picture
from nearfar.illumination.pictures import standard_lights
from nearfar.transport.exact import ExactTransport
from nearfar.transport.known import KnownTransport
from nearfar.transport.model import Transport
from nearfar.workflow.evaluate import (
    Rows,
    can_compare_parts,
    exposure_of,
    fitted_exposure,
    floodlit_snr,
    model_truth,
    percentiles,
    relighting_snr,
    require_same_kind,
    row_snr,
    snr,
    split_snr,
)
from nearfar.workflow.physical_split import physical_snr
from nearfar.workflow.units import find_other_units

# What a judgement says beside its decibels: of units, dark pixels, light that is not there.
REMARKS = (
    "exposure",
    "exposure_is_fitted",
    "pixels_without_light",
    "pairs_without_light",
    "false_subsurface_share",
)

Value = TypeVar("Value")


class Pair(NamedTuple):
    """A relit picture beside the true one.

    Attributes
    ----------
    light, relit, known : ndarray
    """

    light: Floats
    relit: Floats
    known: Floats


def judge_by_truth(
    transport: Transport,
    truth: KnownTransport,
    rows: Rows | None = None,
    *,
    progress: Callable[[str, float], None] | None = None,
) -> dict[str, Any]:
    """Compare a transport with the truth.

    Parameters
    ----------
    transport : Transport
    truth : ExactTransport or ExactOperator
    rows : Rows, optional
        As `nearfar.row_snr` gives them, if they are there already.
    progress : callable, optional
        Called with what is done and the share done.

    Returns
    -------
    dict
        SNR in dB, ready for JSON: ``snr_b`` per light and ``snr_b_pictures`` their mean over
        natural pictures; ``snr_b_frequency`` and ``snr_t`` as percentiles; ``snr`` of T, and of
        the model's D, N and F: ``physical`` of their rows beside the scene's direct light,
        subsurface light and inter-reflection, ``floodlit`` of their pictures under full white,
        ``model`` of their rows beside the model's split of the truth; ``ceiling``, the same lights
        with the model fitted to the truth. ``physical_split`` has the SNR of ``direct``,
        ``subsurface`` and ``interreflection`` of `nearfar.split_physically` under full white, less
        what the scene does not have; without subsurface light, ``false_subsurface_share`` is the
        share of light, 0 to 1, that the split takes for it. ``exposure`` is the
        photo units per unit of the truth, ``exposure_is_fitted`` whether they were fitted to it,
        and ``pixels_without_light`` the camera pixels that the truth leaves dark: they have no
        SNR_t. Beside an operator rows are a sample, and there are no model's split and no
        ceiling, which take all rows; nor are they at a pitch over 1. A physical split is left out
        of transports that have none.

    Raises
    ------
    InputError
        If the truth is of other sizes.
    """
    report = progress or (lambda _what, _share: None)
    lights = standard_lights(transport.projector)
    exposure = exposure_of(transport, truth)
    factor = exposure.factor
    found = relighting_snr(transport, truth, lights, exposure=factor)
    if rows is None:
        rows = row_snr(transport, truth, exposure=factor, progress=report)
    components = dict(rows.components)
    numbers: dict[str, Any] = {
        "exposure": factor,
        "exposure_is_fitted": exposure.is_fitted,
        "pixels_without_light": rows.without_light,
        "snr_b_pictures": _mean_of_pictures(found),
        "snr_b": white_last(found),
        "snr_b_frequency": percentiles(rows.snr_b_of_frequency),
        "snr_t": percentiles(rows.snr_t),
        "snr": {"T": components.pop("T")},
    }
    is_split = can_compare_parts(transport, truth)
    if is_split:
        floodlit = floodlit_snr(transport, truth, factor)
        numbers["snr"] |= {"physical": components, "floodlit": floodlit}
        report("physical split", 0.0)
        numbers |= _physical_split(transport, truth, factor)
        report("physical split", 1.0)
    # The model is fitted to every row, of which an operator has too many, by single pixels.
    if is_split and isinstance(truth, ExactTransport) and transport.pitch == 1:
        report("model's truth", 0.0)
        fitted = model_truth(transport, truth, factor)
        ceiling = relighting_snr(fitted, truth, lights, exposure=factor)
        numbers["snr"]["model"] = split_snr(transport, fitted)
        numbers["ceiling"] = {
            "snr_b_pictures": _mean_of_pictures(ceiling),
            "snr_b": white_last(ceiling),
        }
        report("model's truth", 1.0)
    return numbers


def _physical_split(transport: Transport, truth: KnownTransport, factor: float) -> dict[str, Any]:
    """Return what `judge_by_truth` tells of the physical split."""
    try:
        split = split_physically(transport)
    except InputError:
        return {}
    found = physical_snr(split, truth, exposure=factor)
    numbers: dict[str, Any] = {"physical_split": dict(found.components)}
    if "subsurface" not in found.components:
        numbers["false_subsurface_share"] = found.subsurface_share
    return numbers


def white_last(of_lights: Mapping[str, Value]) -> dict[str, Value]:
    """Return the values of lights with white's at the end: white is measured, not relit."""
    return dict(sorted(of_lights.items(), key=lambda item: item[0] == "white"))


def describe_units(judgement: Mapping[str, Any]) -> list[str]:
    """Return sentences on what a judgement says beside decibels."""
    said = []
    if judgement.get("exposure_is_fitted"):
        said.append(
            f"the truth was multiplied by {judgement['exposure']:.6g}, which fits best: the rig "
            f"did not record the exposure"
        )
    if dark := judgement.get("pixels_without_light"):
        said.append(
            f"{dark} camera pixel{'s' if dark > 1 else ''} without light in the truth left out of "
            f"SNR_t"
        )
    if dark := judgement.get("pairs_without_light"):
        said.append(f"left out of the mean, as the photo holds no light: {', '.join(dark)}")
    if (share := judgement.get("false_subsurface_share")) is not None:
        said.append(
            f"the scene has no subsurface light; the physical split takes {100 * share:.1f} % of "
            f"the light for it"
        )
    return said


def find_faults_of_units(transport: Transport, truth: KnownTransport, name: str) -> list[str]:
    """Find whether a truth is in other units than the rig recorded.

    Parameters
    ----------
    transport : Transport
    truth : ExactTransport or ExactOperator
    name : str
        What the truth is called in the sentence.

    Returns
    -------
    list of str
        A sentence, or nothing.
    """
    fitted = fitted_exposure(transport, truth)

    def reached() -> str:
        lights = standard_lights(transport.projector)
        found = _mean_of_pictures(relighting_snr(transport, truth, lights, exposure=fitted))
        return f"{found:.1f} dB under pictures"

    return find_other_units(
        name,
        fitted=fitted,
        recorded=exposure_of(transport, truth).factor,
        what="the transport is",
        reached=reached,
    )


def _mean_of_pictures(found: dict[str, float]) -> float:
    return float(np.mean([value for name, value in found.items() if name.startswith("picture")]))


def beside_truth(transport: Transport, truth: KnownTransport) -> dict[str, Pair]:
    """Relight under lights of every sort, beside the exact pictures.

    Raises
    ------
    InputError
        If the truth is of other sizes.
    """
    require_same_kind(transport, truth)
    exposure = np.float32(exposure_of(transport, truth).factor)
    found = {}
    for name, light in standard_lights(transport.projector).items():
        relit = transport @ light
        found[name] = Pair(light, relit, (exposure * (truth @ light)).reshape(relit.shape))
    return found


def judge_pairs(pairs: Mapping[str, Pair]) -> dict[str, Any]:
    """Return ``snr_b`` per light and ``snr_b_mean``, dB.

    Photos without any light are left out where there are others, and ``pairs_without_light``
    lists them.
    """
    lit = {name: pair for name, pair in pairs.items() if pair.known.any()} or pairs
    found = {name: snr(pair.known, pair.relit) for name, pair in lit.items()}
    dark = [name for name in pairs if name not in lit]
    judgement = {"snr_b": found, "snr_b_mean": float(np.mean(list(found.values())))}
    return judgement | ({"pairs_without_light": dark} if dark else {})


def beside_photos(
    transport: Transport, folder: Path, *, full_scale: float | None = None
) -> dict[str, Pair]:
    """Relight under lights beside photos of them: pairs NAME.light.*, NAME.photo.*.

    Parameters
    ----------
    transport : Transport
    folder : Path
        A pair whose light is all black gives the photo under black; without one the black that
        was measured with the transport is taken.
    full_scale : float, optional
        Value of full scale of the photos; by default the capture's, for photos of the same dtype.

    Returns
    -------
    dict of str to Pair
        Photos less black.

    Raises
    ------
    MissingFileError, InputError
        If there are no pairs, one is incomplete or twice there, or sizes differ.
    """
    if full_scale is not None and not 0 < full_scale < np.inf:
        raise InputError(f"the full scale {full_scale} is not a positive number: give one above 0.")
    pairs = _pairs(folder)
    photos, lights = {}, {}
    for name, (light_path, photo_path) in pairs.items():
        light = read_light(light_path, transport.projector)
        if light.ndim == 3 and transport.channels == 1:
            light = luminance(light)
        photo = _photo(transport, photo_path, full_scale)
        expected = (*transport.camera, *((transport.channels,) if transport.channels > 1 else ()))
        if photo.shape != expected:
            raise InputError(
                f"{photo_path} has the shape {photo.shape}, this transport's photos {expected}: "
                f"take it with the camera of the capture."
            )
        lights[name], photos[name] = light, photo
    dark = [name for name, light in lights.items() if not light.any()]
    black: Floats = transport.black[..., 0] if transport.channels == 1 else transport.black
    if dark:
        black = np.mean([photos[name] for name in dark], axis=0)
    judged = [name for name in lights if name not in dark]
    if not judged:
        raise InputError(f"{folder} has a black light only: add pairs under other lights.")
    return {
        name: Pair(lights[name], transport @ lights[name], photos[name] - black) for name in judged
    }


def _photo(transport: Transport, path: Path, full_scale: float | None) -> Floats:
    """Read a photo as the capture's were, unless another full scale is given."""
    raw = read_picture(path)
    taken = transport.provenance.get("photos", {})
    if full_scale is None and taken.get("dtype") == str(raw.dtype):
        full_scale = float(taken["full_scale"])
    return raw.astype(np.float32) / np.float32(full_scale or full_scale_of(raw.dtype))


def _pairs(folder: Path) -> dict[str, tuple[Path, Path]]:
    halves: dict[str, dict[str, Path]] = {}
    for path in list_pictures(folder):
        name, _, half = path.name.removesuffix(path.suffix).rpartition(".")
        if half in {"light", "photo"}:
            both = halves.setdefault(name, {})
            if half in both:
                raise InputError(
                    f"{folder} has both {both[half].name} and {path.name}: remove one of them."
                )
            both[half] = path
    if not halves:
        raise MissingFileError(
            f"{folder} holds no pairs: name them NAME.light.png and NAME.photo.tiff."
        )
    for name, both in halves.items():
        for half in ("light", "photo"):
            if half not in both:
                raise MissingFileError(f"{folder} has no {name}.{half}.*: give both of each pair.")
    return {name: (both["light"], both["photo"]) for name, both in halves.items()}
