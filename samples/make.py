"""Make the sample captures anew: run ``python samples/make.py`` in the repository."""

import shutil
from pathlib import Path

import numpy as np
from shoot import photograph

from nearfar import choose_plan, natural_picture
from nearfar.arrays import Floats, Size
from nearfar.files import encode_png
from nearfar.illumination import patterns

HERE = Path(__file__).parent
GRID = Size(32, 32)
CAMERA = Size(96, 96)
SMALL_CAMERA = Size(64, 64)
PERIODS, STEPS = (16, 8, 4), 4
PHOTOS_OF_PLAN = 100
HELD_OUT = 4


def gray_and_fringes() -> list[Floats]:
    """Return Gray code and fringes of columns and of rows, then white and black."""
    found = []
    for axis, draw in ((1, patterns.gray_columns), (0, patterns.gray_rows)):
        for bit in reversed(range(5)):
            found += [draw(bit, GRID), 1 - draw(bit, GRID)]
        place = np.indices(GRID)[axis]
        found += [
            0.5 + 0.5 * np.cos(2 * np.pi * (place / period + step / STEPS))
            for period in PERIODS
            for step in range(STEPS)
        ]
    return [*found, np.ones(GRID), np.zeros(GRID)]


def rounded(picture: Floats) -> Floats:
    """Return a picture as a projector of 8 bits shows it."""
    return np.asarray(np.rint(255 * picture) / 255)


def write(folder: Path, pictures: list[np.ndarray], name: str = "{:02}.png") -> None:
    """Write pictures of 8 or 16 bits."""
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    for number, picture in enumerate(pictures):
        (folder / name.format(number)).write_bytes(encode_png(picture))


def as_bytes(pictures: list[Floats]) -> list[np.ndarray]:
    """Return pictures as 8 bits."""
    return [np.rint(255 * picture).astype(np.uint8) for picture in pictures]


def write_held_out(folder: Path, camera: Size) -> None:
    """Write pictures that no estimate sees, and their photos, with black among them."""
    lights = [natural_picture(GRID, seed=seed) for seed in range(HELD_OUT)]
    lights = [rounded(light / light.max()) for light in lights] + [np.zeros(GRID)]
    write(folder, as_bytes(lights), "{:02}.light.png")
    for number, photo in enumerate(photograph(lights, camera, seed=1)):
        (folder / f"{number:02}.photo.png").write_bytes(encode_png(photo))


def make() -> None:
    """Make all three."""
    pictures = [rounded(picture) for picture in gray_and_fringes()]
    whole = HERE / "gray-and-fringes"
    write(whole / "patterns", as_bytes(pictures))
    write(whole / "photos", photograph(pictures, CAMERA))
    write_held_out(whole / "held-out", CAMERA)

    spoilt = HERE / "spoilt-by-gamma"
    write(spoilt / "patterns", as_bytes(pictures))
    photos = photograph(pictures, SMALL_CAMERA)
    # What a telephone makes of them: 8 bits and a gamma.
    write(spoilt / "photos", as_bytes([(photo / 16383) ** (1 / 2.2) for photo in photos]))

    planned = HERE / "plan"
    plan, _ = choose_plan(GRID, PHOTOS_OF_PLAN)
    drawn = [plan.draw(number) / 255 for number in range(len(plan.patterns))]
    write(planned / "photos", photograph(drawn, SMALL_CAMERA), "IMG_{:03}.png")
    (planned / "plan.json").write_text(plan.model_dump_json(indent=1) + "\n", encoding="utf-8")
    write_held_out(planned / "held-out", SMALL_CAMERA)


if __name__ == "__main__":
    make()
