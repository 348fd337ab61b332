"""Draws the picture of README and of the first page, docs/static/components.png, from a demo.

Run it where `make demo` was run: ``.venv/bin/python docs/picture.py``.
"""

from pathlib import Path

import numpy as np
from matplotlib import pyplot

import nearfar
from nearfar.files import to_srgb

DEMO = Path("nearfar-demo")
PICTURE = Path(__file__).parent / "static" / "components.png"
# Brightness of light under surfaces and of inter-reflection beside direct light.
GAIN = 2
TITLES = (
    "projected",
    "relit, all light",
    "direct",
    f"subsurface, {GAIN} ×",
    f"inter-reflection, {GAIN} ×",
)


def main() -> None:
    """Draw a row of pictures for each light."""
    transport = nearfar.load_transport(DEMO / "transport.zarr")
    split = nearfar.split_physically(transport)
    lights = [nearfar.white(transport.projector), nearfar.penguin(transport.projector)]
    figure, axes = pyplot.subplots(
        len(lights), len(TITLES), figsize=(11, 4.7), layout="constrained"
    )
    for place, title in zip(axes[0], TITLES, strict=True):
        place.set_title(title, fontsize=12)
    for row, light in zip(axes, lights, strict=True):
        direct, under, between = split.components(light)
        pictures = [light, direct + under + between, direct, GAIN * under, GAIN * between]
        for place, picture in zip(row, pictures, strict=True):
            grey = picture.ndim == 2
            coloured = np.repeat(picture[..., None], 3, axis=-1) if grey else picture
            place.imshow(to_srgb(coloured), interpolation="nearest")
            place.set(xticks=(), yticks=())
    figure.savefig(PICTURE, dpi=80, facecolor="white", pil_kwargs={"optimize": True})


if __name__ == "__main__":
    main()
