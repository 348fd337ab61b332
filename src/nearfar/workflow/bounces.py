"""Bounces of a transport that is in a file, and a folder of their pictures."""

import json
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from nearfar.applications.bounces import Bounces, bounces
from nearfar.arrays import Floats
from nearfar.callbacks import Report
from nearfar.estimate.physical import split_physically
from nearfar.files import new_output, write_picture
from nearfar.release import version
from nearfar.transport.stored import StoredTransport
from nearfar.workflow.separate import NUMBERS_NAME, PICTURE_CHANNELS

LATER = "later"
OURS = re.compile(rf"(bounce-[1-9]\d*|{LATER})\.(npy|png)")
# Pictures for looking are brightened by a power of two, until all but so few of their values would
# pass this level.
BRIGHT = 0.9
BRIGHTER_SHARE = 1e-3


def bounces_of_stored(
    stored: StoredTransport, light: Floats, count: int, *, progress: Report | None = None
) -> Bounces:
    """Take a relit picture apart by how often its light was reflected; see `nearfar.bounces`.

    The first bounce is direct light and light under surfaces, of the physical split; of a transport
    without near-range light, which has none, it is direct light.

    Raises
    ------
    InputError
        As `nearfar.bounces`.
    """
    whole = stored.rows()
    has_near = "near" in whole.parts
    return bounces(split_physically(whole) if has_near else whole, light, count, progress=progress)


def describe_bounces(found: Bounces) -> dict[str, Any]:
    """Return shares of light, what was found of the scene, and gains of pictures, as JSON types."""
    pictures = _named(found)
    return {
        "bounces": len(found.pictures),
        "shares": list(found.shares),
        "later_share": found.later_share,
        "negative_shares": list(found.negative),
        "unseen_share": found.unseen,
        "residual": found.residual,
        "faults": list(found.faults),
        "png_gains": {name: _brightening(picture) for name, picture in pictures.items()},
        "nearfar": version(),
    }


def summarise_bounces(numbers: Mapping[str, Any]) -> str:
    """Return in lines what `describe_bounces` says."""
    gains = numbers["png_gains"]
    shares = [*numbers["shares"], numbers["later_share"]]
    named = zip(gains, shares, strict=True)
    return "\n".join(
        f"{name.replace('-', ' ')}{' bounces' if name == LATER else ''}: {share:.2%} of the light"
        + (f"; the .png is {gains[name]} × as bright" if gains[name] > 1 else "")
        for name, share in named
    )


def write_bounces(
    folder: Path, found: Bounces, numbers: Mapping[str, Any], *, force: bool = False
) -> None:
    """Write ``bounce-1`` and so on and ``later``, .npy and .png, and numbers.json, in a folder.

    More or fewer channels than a picture's go into the .npy alone.

    Raises
    ------
    NearfarError
        As `nearfar.files.new_output`.
    """
    channels = 1 if found.later.ndim == 2 else found.later.shape[2]
    with new_output(folder, force=force, replaceable=is_bounces) as partial:
        partial.mkdir()
        for name, picture in _named(found).items():
            write_picture(partial / f"{name}.npy", picture)
            if channels in PICTURE_CHANNELS:
                bright = np.float32(numbers["png_gains"][name]) * picture
                write_picture(partial / f"{name}.png", bright)
        text = json.dumps(numbers, indent=2, allow_nan=False)
        (partial / NUMBERS_NAME).write_text(text + "\n", encoding="utf-8")


def is_bounces(folder: Path) -> bool:
    """Return whether a folder is empty, or holds pictures of bounces alone."""
    names = [entry.name for entry in folder.iterdir()]
    ours = all(name == NUMBERS_NAME or OURS.fullmatch(name) for name in names)
    return ours and (not names or NUMBERS_NAME in names)


def _named(found: Bounces) -> dict[str, Floats]:
    numbered = {f"bounce-{number}": picture for number, picture in enumerate(found.pictures, 1)}
    return {**numbered, LATER: found.later}


def _brightening(picture: Floats) -> int:
    """Return the power of two, 1 or more, that brightens a picture for looking."""
    bright = float(np.quantile(picture, 1 - BRIGHTER_SHARE))
    if bright <= 0:
        return 1
    return int(2 ** np.clip(np.floor(np.log2(BRIGHT / bright)), 0, 20))
