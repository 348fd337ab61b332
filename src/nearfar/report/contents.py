"""Descriptions of files and folders, for ``nearfar info``."""

import json
from pathlib import Path

import numpy as np

from nearfar.arrays import Size
from nearfar.capture import KIND as CAPTURE_KIND
from nearfar.capture import Capture, open_capture
from nearfar.errors import MissingFileError, UnreadableFileError
from nearfar.files import kind_of_store, list_pictures, read_arrays, read_picture
from nearfar.plan import Plan, read_plan
from nearfar.report.plan import describe_plan, describe_range
from nearfar.rigs.tables import read_rig_table
from nearfar.scenes.mitsuba.loading import load_scene
from nearfar.transport.exact_store import KIND as EXACT_KIND
from nearfar.transport.exact_store import load_exact
from nearfar.transport.gains import why_unjudgeable
from nearfar.transport.model import Transport
from nearfar.transport.operator_store import KIND as OPERATOR_KIND
from nearfar.transport.store import load_transport
from nearfar.transport.store_format import KIND as TRANSPORT_KIND
from nearfar.transport.verdict import NOT_JUDGED


def describe(path: Path) -> str:
    """Return a description of a file or a folder, in lines.

    Parameters
    ----------
    path : Path
        Plan, capture, transport, array, picture, RIG.toml, Mitsuba scene, or folder of pictures.

    Returns
    -------
    str

    Raises
    ------
    MissingFileError
        If there is no such file or folder.
    UnreadableFileError
        If it is of another kind, or damaged.
    NearfarError
        As the reader of its kind.
    """
    if not path.exists():
        raise MissingFileError(f"{path} is not there: check the name.")
    return _describe_folder(path) if path.is_dir() else _describe_file(path)


def _describe_file(path: Path) -> str:
    match path.suffix.lower():
        case ".json":
            return "nearfar plan\n" + _describe_plan(read_plan(path))
        case ".toml":
            return f"rig: {json.dumps(read_rig_table(path).model_dump())}"
        case ".npy" | ".npz":
            return _describe_arrays(path)
        case ".xml":
            return _describe_mitsuba(path)
    pixels = read_picture(path)
    shape = " x ".join(map(str, pixels.shape))
    return f"picture, {shape} {pixels.dtype}, values {pixels.min():g} to {pixels.max():g}"


def _describe_mitsuba(path: Path) -> str:
    loaded = load_scene(path, Size(1, 1))
    return (
        f"Mitsuba scene: projector {loaded.picture or 'without a picture of its own'}, camera "
        f"{loaded.camera}, {_channels(loaded.channels)}, integrator {loaded.integrator}, "
        f"{loaded.samples} samples per camera pixel"
    )


def _describe_arrays(path: Path) -> str:
    lines = []
    for name, array in read_arrays(path).items():
        shape = " x ".join(map(str, array.shape)) or "a single number"
        line = f"{name}, {shape} {array.dtype}"
        if array.dtype.kind in "fiu" and array.size:
            finite = array[np.isfinite(array)]
            if finite.size:
                line += f", values {finite.min():g} to {finite.max():g}"
            if finite.size < array.size:
                line += f", {array.size - finite.size} NaN or infinite"
        lines.append(line)
    return "\n".join(lines)


def _describe_folder(path: Path) -> str:
    describe = {
        CAPTURE_KIND: _describe_capture,
        TRANSPORT_KIND: _describe_transport,
        EXACT_KIND: _describe_exact,
        OPERATOR_KIND: _describe_exact,
    }.get(kind_of_store(path) or "")
    if describe is not None:
        return describe(path)
    pictures = list_pictures(path)
    if not pictures or (path / "zarr.json").exists():
        raise UnreadableFileError(
            f"{path} is nothing that nearfar wrote: name a plan, a capture, a transport or a "
            f"picture."
        )
    return f"folder of {len(pictures)} pictures, {pictures[0].name} to {pictures[-1].name}"


def _describe_plan(plan: Plan) -> str:
    """Describe a plan and the SNR_b that it was chosen for, if it was."""
    expected = [] if plan.expected_snr is None else [describe_range(plan.expected_snr)]
    return "\n".join(
        [describe_plan(plan), *(f"expected of relighting: {each}" for each in expected)]
    )


def _describe_capture(path: Path) -> str:
    capture = open_capture(path)
    return "\n".join(
        [
            f"{CAPTURE_KIND}: photos of {capture.camera}, {_channels(capture.channels)}, "
            f"{capture.photos.dtype}, full scale {capture.full_scale:g}, "
            f"{capture.saturated_share:.3%} saturated",
            _describe_plan(capture.plan),
            f"rig: {json.dumps(capture.rig)}",
            *_describe_acquisition(capture),
        ]
    )


def _describe_acquisition(capture: Capture) -> list[str]:
    """Describe the duration, the conditions that changed between photos, and the alarms."""
    lines = [f"taken in {capture.times.max() - capture.times.min():.0f} s"]
    for name, values in capture.conditions.items():
        known = [value for value in values if value is not None]
        if known:
            lines.append(f"{name}: {min(known):.6g} to {max(known):.6g}")
    return lines + [f"alarm: {text}" for text in capture.alarms]


def _describe_transport(path: Path) -> str:
    transport = load_transport(path)
    floodlit = transport.components(np.ones(transport.projector, dtype=np.float32))
    sums = {name: float(part.sum()) for name, part in transport.named(floodlit).items()}
    total = sum(sums.values())
    shares = ", ".join(f"{name} {value / total:.1%}" for name, value in sums.items() if total)
    return "\n".join(
        [
            _verdict_of(transport),
            f"{TRANSPORT_KIND}: projector {transport.projector}, camera {transport.camera}, "
            f"{_channels(transport.channels)}, {_model_of(transport)}",
            *_directly_lit(transport),
            *_gains_of(transport),
            f"floodlit: {shares or 'black'}",
            f"provenance: {json.dumps(dict(transport.provenance))}",
        ]
    )


def _directly_lit(transport: Transport) -> list[str]:
    """Return how many camera pixels have direct light, and how many of two surfaces."""
    if "direct" not in transport.parts:
        return []
    said = f"{transport.lit.mean():.1%} of the camera pixels directly lit"
    second = transport.factors.second
    if second is not None:
        share = len(second.pixels) / transport.camera.pixels
        said += f", {share:.1%} from a second place, too"
    return [said]


def _gains_of(transport: Transport) -> list[str]:
    """Return a line about the lamps of a light stage, none of other transports."""
    gains, errors = (
        np.array(transport.provenance.get(name, ()), dtype=np.float64)
        for name in ("lamp_gains", "lamp_gain_errors")
    )
    if "lamps" not in transport.provenance:
        return []
    if not len(gains) or len(gains) != len(errors):
        return ["light stage, a photo under each lamp: gains not fitted"]
    return [
        f"light stage, a photo under each lamp: gains from {gains.min():.3g} to {gains.max():.3g}, "
        f"each +- {errors.mean():.2g}"
    ]


def _model_of(transport: Transport) -> str:
    """Return the ranges of a transport, and how many numbers describe them."""
    near = f"W = {transport.window}{_pitch(transport.pitch)}"
    far = f"{transport.far_basis.count} far coefficients"
    if "free" in transport.parts:
        lamps = f"{transport.projector.pixels} lamps, each a number of its own at a camera pixel"
        return f"no near or far range: {lamps}"
    absent = [f"no {part} range" for part in ("near", "far") if part not in transport.parts]
    ranges = [text for part, text in (("near", near), ("far", far)) if part in transport.parts]
    return ", ".join([*ranges, *absent])


def _verdict_of(transport: Transport) -> str:
    """Return the verdict on a transport, or why there is none."""
    if transport.verdict is not None:
        return str(transport.verdict)
    why = why_unjudgeable(transport.provenance)
    return NOT_JUDGED if why is None else f"not judged: it {why}"


def _describe_exact(path: Path) -> str:
    exact = load_exact(path)
    return (
        f"{kind_of_store(path)}: {exact.name}, projector {exact.projector}, camera {exact.camera}, "
        f"{_channels(exact.channels)}, components {'apart' if exact.is_apart else 'together'}"
    )


def _pitch(pitch: int) -> str:
    return "" if pitch == 1 else f" functions {pitch} projector pixels apart"


def _channels(count: int) -> str:
    return f"{count} channel{'s' if count > 1 else ''}"
