"""Judge a transport by the truth, or by photos that it never saw."""

from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from nearfar.arrays import Floats
from nearfar.errors import InputError, MissingFileError
from nearfar.files import full_scale_of, list_pictures, luminance, read_light, read_picture
from nearfar.illumination.pictures import standard_lights
from nearfar.transport.exact import ExactTransport
from nearfar.transport.model import Transport
from nearfar.workflow.evaluate import (
    Rows,
    floodlit_snr,
    model_truth,
    percentiles,
    relighting_snr,
    require_same_kind,
    row_snr,
    snr,
    split_snr,
    transport_exposure,
)


class Pair(NamedTuple):
    """A relit picture beside what it should be.

    Attributes
    ----------
    light, relit, known : ndarray
    """

    light: Floats
    relit: Floats
    known: Floats


def judge_by_truth(
    transport: Transport,
    truth: ExactTransport,
    rows: Rows | None = None,
    *,
    progress: Callable[[str, float], None] | None = None,
) -> dict[str, Any]:
    """Compare a transport with the truth.

    Parameters
    ----------
    transport : Transport
    truth : ExactTransport
    rows : Rows, optional
        As `nearfar.row_snr` gives them, if they are there already.
    progress : callable, optional
        Called with what is done and the share done.

    Returns
    -------
    dict
        SNR in dB, ready for JSON: ``snr_b`` per light and ``snr_b_pictures`` their mean over
        natural pictures; ``snr_b_frequency`` and ``snr_t`` as percentiles; ``snr`` of T, D, N
        and F with the physical and the model's split, and of their pictures under full white;
        ``ceiling``, the same lights with the model fitted to the truth.

    Raises
    ------
    InputError
        If the truth is of other sizes.
    """
    report = progress or (lambda _what, _share: None)
    lights = standard_lights(transport.projector)
    found = relighting_snr(transport, truth, lights)
    if rows is None:
        rows = row_snr(transport, truth, progress=report)
    components = dict(rows.components)
    numbers: dict[str, Any] = {
        "snr_b": found,
        "snr_b_pictures": _mean_of_pictures(found),
        "snr_b_frequency": percentiles(rows.snr_b_of_frequency),
        "snr_t": percentiles(rows.snr_t),
        "snr": {"T": components.pop("T")},
    }
    if truth.is_apart:
        report("model's truth", 0.0)
        fitted = model_truth(transport, truth)
        ceiling = relighting_snr(fitted_as(transport, fitted), truth, lights)
        numbers["snr"] |= {
            "physical": components,
            "model": split_snr(transport, fitted),
            "floodlit": floodlit_snr(transport, truth),
        }
        numbers["ceiling"] = {"snr_b": ceiling, "snr_b_pictures": _mean_of_pictures(ceiling)}
        report("model's truth", 1.0)
    return numbers


def fitted_as(transport: Transport, fitted: Transport) -> Transport:
    """Give a fitted transport the provenance of the measured one, exposure and all."""
    return replace(fitted, provenance=transport.provenance)


def _mean_of_pictures(found: dict[str, float]) -> float:
    return float(np.mean([value for name, value in found.items() if name.startswith("picture")]))


def beside_truth(transport: Transport, truth: ExactTransport) -> dict[str, Pair]:
    """Relight under lights of every sort, beside the exact pictures.

    Raises
    ------
    InputError
        If the truth is of other sizes.
    """
    require_same_kind(transport, truth)
    exposure = np.float32(transport_exposure(transport))
    found = {}
    for name, light in standard_lights(transport.projector).items():
        relit = transport @ light
        found[name] = Pair(light, relit, (exposure * (truth @ light)).reshape(relit.shape))
    return found


def judge_pairs(pairs: Mapping[str, Pair]) -> dict[str, Any]:
    """Return ``snr_b`` per light and ``snr_b_mean``, dB."""
    found = {name: snr(pair.known, pair.relit) for name, pair in pairs.items()}
    return {"snr_b": found, "snr_b_mean": float(np.mean(list(found.values())))}


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
