"""Lights to relight under: natural pictures, fine detail, noise.

The natural pictures are dead leaves (Lee, Mumford and Huang 2001): discs with a power law of
sizes, each hiding what lies under it, which share edges, flat parts and 1/f spectra with
photographs. They are made here, so they come with no licence and in any size.
"""

import numpy as np

from nearfar.arrays import AnySize, Floats, Size, as_size
from nearfar.checks import as_count

# Drawn this many times finer on each axis, then averaged: edges fall between pixels, as in
# photographs.
OVERSAMPLING = 4
# Natural pictures of more drawn points are oversampled half as much, or not at all: on the pixels
# of a fine projector an edge is of little account, and a picture takes a second.
MOST_DRAWN = 2**23
NUMBER_OF_LEAVES = 2000
# Radii, as shares of the longer side.
SMALLEST_RADIUS = 0.035
LARGEST_RADIUS = 0.6


def white(size: AnySize) -> Floats:
    """Return full white.

    Parameters
    ----------
    size : Size or (height, width)

    Returns
    -------
    ndarray, shape (Py, Px), float32

    Raises
    ------
    InputError
        If the size is not one.

    Examples
    --------
    >>> nearfar.white((2, 3))
    array([[1., 1., 1.],
           [1., 1., 1.]], dtype=float32)
    """
    return np.ones(as_size(size), dtype=np.float32)


def _averaged(drawn: Floats, size: Size) -> Floats:
    """Average what was drawn finer: (Py, Px, channels), float32."""
    finer = drawn.shape[0] // size.height
    averaged = drawn.reshape(size.height, finer, size.width, finer, -1).mean(axis=(1, 3))
    return np.asarray(averaged, dtype=np.float32)


def natural_picture(size: AnySize, seed: int, *, colour: bool = False) -> Floats:
    """Draw dead leaves in linear light.

    Parameters
    ----------
    size : Size or (height, width)
    seed : int
        Which picture.
    colour : bool
        Three channels instead of one.

    Returns
    -------
    ndarray, shape (Py, Px) or (Py, Px, 3), float32
        Values in [0, 1].

    Raises
    ------
    InputError
        If the size is not one, or the seed is not a whole number from 0 on.

    Examples
    --------
    >>> picture = nearfar.natural_picture((8, 8), seed=3, colour=True)
    >>> picture.shape, picture.dtype
    ((8, 8, 3), dtype('float32'))
    """
    size, seed = as_size(size), as_count(seed, "the seed", 0)
    generator = np.random.default_rng([seed, 2001])
    finer = OVERSAMPLING
    while finer > 1 and size.pixels * finer**2 > MOST_DRAWN:
        finer //= 2
    height, width = size.height * finer, size.width * finer
    longest = max(height, width)
    drawn = np.zeros((height, width, 3 if colour else 1))
    empty = np.ones((height, width), dtype=bool)
    # Areas fall off as 1/r^3.
    low, high = LARGEST_RADIUS**-2, SMALLEST_RADIUS**-2
    for _ in range(NUMBER_OF_LEAVES):
        radius = longest * generator.uniform(low, high) ** -0.5
        middle = generator.random(2) * [height, width]
        # Reflectances of natural scenes are skewed to the dark.
        shade = generator.uniform(0.05, 1.0) ** 1.8
        tint = shade * generator.uniform(0.6, 1.0, size=3)[: drawn.shape[2]]
        slope = generator.normal(0.0, 0.4, size=2)
        box = tuple(
            slice(max(0, int(m - radius)), min(side, int(m + radius) + 2))
            for m, side in zip(middle, (height, width), strict=True)
        )
        # Front to back: a leaf only fills what is still empty, and most are behind others.
        if not empty[box].any():
            continue
        down = (np.arange(height)[box[0], None] - middle[0]) / radius
        across = (np.arange(width)[None, box[1]] - middle[1]) / radius
        leaf = empty[box] & (down**2 + across**2 <= 1.0)
        if not leaf.any():
            continue
        shading = 1.0 + slope[0] * down + slope[1] * across
        drawn[box][leaf] = np.clip(tint * shading[leaf][:, None], 0.0, 1.0)
        empty[box] &= ~leaf
        if not empty.any():
            break
    drawn[empty] = 0.2
    picture = _averaged(drawn, size)
    return picture if colour else picture[..., 0]


# Parts of the penguin, back to front: (y, x, half height, half width, tilt, colour) in a unit
# square, colours in linear light.
_PENGUIN = (
    (0.93, 0.50, 0.16, 0.90, 0.0, (0.80, 0.88, 0.95)),
    (0.60, 0.27, 0.25, 0.07, 0.35, (0.03, 0.03, 0.05)),
    (0.60, 0.73, 0.25, 0.07, -0.35, (0.03, 0.03, 0.05)),
    (0.58, 0.50, 0.36, 0.24, 0.0, (0.03, 0.03, 0.05)),
    (0.63, 0.50, 0.30, 0.17, 0.0, (0.95, 0.95, 0.90)),
    (0.25, 0.50, 0.17, 0.16, 0.0, (0.03, 0.03, 0.05)),
    (0.29, 0.43, 0.10, 0.07, 0.0, (0.95, 0.95, 0.90)),
    (0.29, 0.57, 0.10, 0.07, 0.0, (0.95, 0.95, 0.90)),
    (0.25, 0.44, 0.030, 0.024, 0.0, (0.02, 0.02, 0.02)),
    (0.25, 0.56, 0.030, 0.024, 0.0, (0.02, 0.02, 0.02)),
    (0.325, 0.50, 0.035, 0.055, 0.0, (0.95, 0.45, 0.03)),
    (0.93, 0.40, 0.035, 0.09, 0.0, (0.95, 0.40, 0.02)),
    (0.93, 0.60, 0.035, 0.09, 0.0, (0.95, 0.40, 0.02)),
)


def penguin(size: AnySize) -> Floats:
    """Draw a penguin on ice under a sky, after the paper's figure 2.

    Parameters
    ----------
    size : Size or (height, width)

    Returns
    -------
    ndarray, shape (Py, Px, 3), float32
        Linear light, values in [0, 1].

    Raises
    ------
    InputError
        If the size is not one.

    Examples
    --------
    >>> nearfar.penguin((8, 8)).shape
    (8, 8, 3)
    """
    size = as_size(size)
    height, width = size.height * OVERSAMPLING, size.width * OVERSAMPLING
    side = min(height, width)
    y = (np.arange(height)[:, None] + 0.5 - height / 2) / side + 0.5
    x = (np.arange(width)[None, :] + 0.5 - width / 2) / side + 0.5
    sky = np.array([0.10, 0.30, 0.75]) + np.clip(y, 0, 1)[..., None] * [0.45, 0.40, 0.15]
    drawn = np.broadcast_to(sky, (height, width, 3)).copy()
    for centre_y, centre_x, half_y, half_x, tilt, colour in _PENGUIN:
        down, across = y - centre_y, x - centre_x
        along = down * np.cos(tilt) - across * np.sin(tilt)
        beside = down * np.sin(tilt) + across * np.cos(tilt)
        drawn[(along / half_y) ** 2 + (beside / half_x) ** 2 <= 1.0] = colour
    return _averaged(drawn, size)


def landscape(size: Size) -> Floats:
    """Draw hills and a lake under a sky, after the paper's figure 4: (Py, Px, 3), float32."""
    height, width = size.height * OVERSAMPLING, size.width * OVERSAMPLING
    y = (np.arange(height)[:, None] + 0.5) / height
    x = (np.arange(width)[None, :] + 0.5) / width
    drawn = np.array([0.08, 0.30, 0.85]) + np.clip(y * 1.6, 0, 1)[..., None] * [0.5, 0.45, 0.15]
    drawn = np.broadcast_to(drawn, (height, width, 3)).copy()
    drawn[(y - 0.2) ** 2 + (x - 0.74) ** 2 < 0.07**2] = (1.0, 0.95, 0.7)
    # Ranges, far to near: height of the ridge, its waves, and the colour at the ridge.
    ranges = (
        (0.48, ((0.07, 1.3, 0.4), (0.03, 3.7, 1.9)), (0.20, 0.32, 0.42)),
        (0.60, ((0.05, 2.1, 2.6), (0.02, 6.3, 0.2)), (0.10, 0.36, 0.12)),
        (0.78, ((0.04, 1.7, 1.1), (0.01, 9.1, 2.2)), (0.16, 0.50, 0.05)),
    )
    for level, waves, colour in ranges:
        ridge = level + sum(a * np.sin(2 * np.pi * k * x + phase) for a, k, phase in waves)
        below = y > ridge
        shade = 1.0 - 0.6 * np.clip((y - ridge) / 0.25, 0, 1)
        drawn[below] = (np.array(colour) * shade[..., None])[below]
    drawn[((y - 0.9) / 0.05) ** 2 + ((x - 0.36) / 0.26) ** 2 < 1] = (0.15, 0.35, 0.60)
    return _averaged(drawn, size)


# Letters of 5 x 7 dots, a row of dots in each number's bits.
_LETTERS = {
    "A": (14, 17, 17, 31, 17, 17, 17),
    "D": (30, 17, 17, 17, 17, 17, 30),
    "E": (31, 16, 16, 30, 16, 16, 31),
    "F": (31, 16, 16, 30, 16, 16, 16),
    "I": (14, 4, 4, 4, 4, 4, 14),
    "M": (17, 27, 21, 21, 17, 17, 17),
    "N": (17, 25, 21, 19, 17, 17, 17),
    "O": (14, 17, 17, 17, 17, 17, 14),
    "R": (30, 17, 17, 30, 20, 18, 17),
    " ": (0, 0, 0, 0, 0, 0, 0),
}
_TEXT = "NEAR AND FAR FROM "


def lettering(size: Size) -> Floats:
    """Draw lines of small letters, black on white, strokes one pixel wide: (Py, Px), float32."""
    dots = [
        np.array([[row >> (4 - x) & 1 for x in range(5)] for row in _LETTERS[letter]])
        for letter in _TEXT
    ]
    line = np.concatenate([np.pad(letter, ((1, 1), (0, 1))) for letter in dots], axis=1)
    repeated = np.tile(line, (1, size.width // line.shape[1] + 2))
    lines = [
        # Each line starts at another letter, so that no two are alike.
        repeated[:, 36 * number % line.shape[1] :][:, : size.width]
        for number in range(size.height // len(line) + 1)
    ]
    picture: Floats = (1.0 - np.concatenate(lines)[: size.height]).astype(np.float32)
    return picture


def random_pattern(size: AnySize, seed: int) -> Floats:
    """Draw an independent value at every pixel, uniform between 0 and 1.

    Parameters
    ----------
    size : Size or (height, width)
    seed : int
        Which pattern.

    Returns
    -------
    ndarray, shape (Py, Px), float32

    Raises
    ------
    InputError
        If the size is not one, or the seed is not a whole number from 0 on.

    Examples
    --------
    >>> pattern = nearfar.random_pattern((8, 8), seed=0)
    >>> bool(pattern.min() >= 0 and pattern.max() < 1)
    True
    """
    generator = np.random.default_rng([as_count(seed, "the seed", 0), 1])
    return np.asarray(generator.random(as_size(size), dtype=np.float32))


def standard_lights(size: Size) -> dict[str, Floats]:
    """Return the lights that relighting is judged under: white, five pictures, random."""
    return {
        "white": white(size),
        **{f"picture-{i}": natural_picture(size, i) for i in range(1, 6)},
        "random": random_pattern(size, 0),
    }
