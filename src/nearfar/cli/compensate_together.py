"""``nearfar compensate --and``: a light for each of several projectors."""

import json
from pathlib import Path
from typing import NamedTuple

from nearfar.cli.lights import read_camera_picture
from nearfar.cli.options import keep_apart, keep_input
from nearfar.cli.other_projectors import OtherProjector, open_transports
from nearfar.cli.saying import say
from nearfar.progress import progress_bar


class Wanted(NamedTuple):
    """What the photo is to look like, and what is written besides lights.

    Attributes
    ----------
    picture : Path
    scale : float or None
        None for one that is to be chosen.
    srgb : bool
    expected, out_of_reach : Path or None
        Where to write what the photo is expected to be, and the map.
    """

    picture: Path
    scale: float | None
    srgb: bool
    expected: Path | None
    out_of_reach: Path | None


def compensate_projectors(
    projectors: list[OtherProjector], wanted: Wanted, *, as_json: bool, force: bool, quiet: bool
) -> None:
    """Find a light for each projector, and write it beside its transport's name."""
    import numpy as np

    from nearfar.applications.compensate_together import (
        compensate_together,
        describe,
        summarise,
    )
    from nearfar.files import check_output, check_picture_ending, write_light, write_picture

    paths, lights = zip(*projectors, strict=True)
    outputs = [*lights, *filter(None, (wanted.expected, wanted.out_of_reach))]
    keep_apart(outputs)
    for path in outputs:
        check_picture_ending(path)
        keep_input(path, *paths, wanted.picture)
        check_output(path, force=force)
    with progress_bar("compensation", quiet=quiet) as report:
        opened = open_transports(paths)
        first = opened[0]
        picture = read_camera_picture(
            wanted.picture, first.camera, first.channels, srgb=wanted.srgb
        )
        found = compensate_together(
            [each.rows() for each in opened], picture, wanted.scale, progress=report
        )
        if wanted.expected is not None:
            write_picture(wanted.expected, found.expected, force=force)
        if wanted.out_of_reach is not None:
            write_picture(wanted.out_of_reach, found.out_of_reach.astype(np.float32), force=force)
        for path, light in zip(lights, found.lights, strict=True):
            write_light(path, light, force=force)
    if as_json:
        print(json.dumps(describe(found), allow_nan=False))
        return
    written = [
        f"light of {each.projector} written to {path}"
        for each, path in zip(opened, lights, strict=True)
    ]
    say("\n".join([summarise(found), *written]), quiet=quiet)
