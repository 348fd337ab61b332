"""Drift of lamp and ambient light through a capture, estimated from its whites and blacks.

A photo of pattern l at time t is ambient(t, c) + lamp(t) (T l)(c). Black photos
measure the ambient light (with the camera's black level and the projector's own black), white ones
what the lamp adds. The lamp has one gain per channel. Ambient light changes by a constant, by a
share of itself and by a share of the white picture: three numbers per channel for any scene, so
that the correction adds next to no noise. Gains and changes are interpolated linearly between
references and constant before the first and after the last.

Index convention: t runs over photos, c over camera pixels row by row, i over channels, j over
the shapes of a change: 1, black, light = white - black.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from nearfar.arrays import Booleans, Floats, Integers
from nearfar.errors import InputError
from nearfar.illumination.frequencies import DC
from nearfar.parallel import side_by_side
from nearfar.photometry.photos import Photos, in_batches
from nearfar.photometry.robust import robust_fit
from nearfar.plan import Plan, Sinusoid
from nearfar.plan.references import FEWEST

# Camera pixels of a fit, evenly spaced. At half a percent of noise they determine the lamp's gain
# to 1e-5; more would only take time.
SAMPLED_PIXELS = 2**17
# 1, black and light.
SHAPES = 3
# Standard deviation of the lamp's gain above which a channel's lamp is taken as constant.
LARGEST_GAIN_ERROR = 0.02
# Gain of the lamp, over its mean, below which it has failed.
LEAST_LAMP = 0.1
# Where it is that weak, and a black holds this much more of white's light than another, the black
# shows white.
LARGEST_BLACK = 0.5


class References(NamedTuple):
    """Numbers of the photos of white and of black, in order."""

    whites: NDArray[np.int64]
    blacks: NDArray[np.int64]


def find_references(plan: Plan) -> References:
    """Find a plan's whites and blacks.

    Raises
    ------
    InputError
        If there are fewer than two of either.
    """
    found = References(
        *(
            np.array(
                [
                    number
                    for number, pattern in enumerate(plan.patterns)
                    if isinstance(pattern, Sinusoid)
                    and pattern.frequency == DC
                    and pattern.inverse == inverse
                ],
                dtype=np.int64,
            )
            for inverse in (False, True)
        )
    )
    if min(map(len, found)) < FEWEST:
        raise InputError(
            f"the plan shows white {len(found.whites)} and black {len(found.blacks)} times, "
            f"too few to estimate noise and drift from: plan again with `offset='reference'`, "
            f"which shows each at least {FEWEST} times."
        )
    return found


@dataclass(frozen=True, eq=False)
class Drift:
    """How lamp and ambient light changed through a capture.

    Attributes
    ----------
    references : References
    black, light : ndarray, shape (Cy, Cx, channels), float32
        Mean ambient light, and what white adds to it under the mean lamp.
    unsaturated : ndarray of bool, shape (Cy, Cx, channels)
        Where no white is at full scale.
    ambient : ndarray, shape (blacks, 3, channels)
        Change of the ambient light at each black, as multiples of 1, black and light.
    lamp : ndarray, shape (whites, channels)
        The lamp at each white; its mean is 1.
    """

    references: References
    black: Floats
    light: Floats
    unsaturated: Booleans
    ambient: NDArray[np.float64]
    lamp: NDArray[np.float64]

    @property
    def lamp_range(self) -> float:
        """Largest less smallest lamp, as a share of its mean; of the worst channel."""
        return float(np.ptp(self.lamp, axis=0).max())

    @property
    def ambient_range(self) -> float:
        """Largest less smallest ambient light, mean over the camera, as a share of white's."""
        shapes = [np.ones(self.lamp.shape[1])]
        shapes += [picture.mean(axis=(0, 1), dtype=np.float64) for picture in self._pictures]
        moved = np.ptp(np.einsum("tji,ji->ti", self.ambient, np.stack(shapes)), axis=0)
        white = shapes[2]
        return float(np.max(moved / np.where(white > 0, white, np.inf)))

    @property
    def _pictures(self) -> tuple[Floats, Floats]:
        return self.black, self.light

    def with_nothing_left(self, references: References) -> "Drift":
        """Return the drift of photos from which it is removed, in a plan of these references."""
        ambient, lamp = np.zeros_like(self.ambient), np.ones_like(self.lamp)
        return replace(self, references=references, ambient=ambient, lamp=lamp)

    def of_pixels(self, chosen: slice) -> "Drift":
        """Return the drift at some camera pixels, as those of a camera of one row."""
        channels = self.black.shape[-1]
        pictures = ("black", "light", "unsaturated")
        return replace(
            self,
            **{name: getattr(self, name).reshape(1, -1, channels)[:, chosen] for name in pictures},
        )

    def remove_from(self, photos: Floats, numbers: Sequence[int], rows: slice) -> Floats:
        """Remove the drift from photos: as if lamp and ambient light had been at their means.

        Parameters
        ----------
        photos : ndarray, shape (n, rows, Cx, channels)
        numbers : sequence of int
            Which photos they are.
        rows : slice
            Which rows of the camera.

        Returns
        -------
        ndarray, as `photos`
        """
        black, light = (picture[rows] for picture in self._pictures)
        ambient = _between(self.ambient, self.references.blacks, numbers).astype(np.float32)
        lamp = _between(self.lamp, self.references.whites, numbers).astype(np.float32)
        corrected = np.empty_like(photos)
        for photo, (constant, own, white), gain, out in zip(
            photos, ambient, lamp, corrected, strict=True
        ):
            out[...] = black + (photo - (constant + (1 + own) * black + white * light)) / gain
        return corrected

    def remove_from_sample(self, sample: Floats, number: int) -> Floats:
        """Remove the drift from a photo of these camera pixels, (S, channels)."""
        still: Floats = self.remove_from(sample[None, None], [number], slice(None))[0, 0]
        return still


def _between(values: Floats, at: Integers, numbers: Sequence[int]) -> NDArray[np.float64]:
    """Interpolate `values`, (references, ...), to photo numbers: (n, ...)."""
    flat = values.reshape(len(at), -1)
    found = np.stack([np.interp(numbers, at, column) for column in flat.T], axis=-1)
    return found.reshape(len(numbers), *values.shape[1:])


class Followed(NamedTuple):
    """The drift of a capture, and samples of its references.

    Attributes
    ----------
    drift : Drift
    samples : mapping
        Each white and black as it was taken, at `sampled_pixels`, (S, channels), float32.
    """

    drift: Drift
    samples: Mapping[int, Floats]


def follow_drift(photos: Photos, progress: Callable[[int], None] | None = None) -> Followed:
    """Estimate the drift of lamp and ambient light by robust least squares over the camera.

    Parameters
    ----------
    photos : Photos
        With at least two whites and two blacks; only these are read, once each.
    progress : callable, optional
        Called with the number of photos read, and then fitted, so far.

    Returns
    -------
    Followed

    Raises
    ------
    InputError
        If there are fewer whites or blacks, or the lamp failed at a white.
    """
    references = find_references(photos.plan)
    whites, blacks = references
    report = progress or (lambda _done: None)
    rows, shape = slice(0, photos.camera.height), (photos.camera.pixels, photos.channels)
    unsaturated = np.ones(shape, dtype=bool)
    white, black = np.zeros(shape), np.zeros(shape)
    sampled = sampled_pixels(photos)
    samples: dict[int, Floats] = {}
    for numbers, read in in_batches(photos, whites.tolist(), rows):
        white += read.sum(axis=0, dtype=np.float64) / len(whites)
        unsaturated &= (read < 1.0).all(axis=0)
        samples |= zip(numbers, read[:, sampled].copy(), strict=True)
        report(len(samples))
    for numbers, read in in_batches(photos, blacks.tolist(), rows):
        black += read.sum(axis=0, dtype=np.float64) / len(blacks)
        samples |= zip(numbers, read[:, sampled].copy(), strict=True)
        report(len(samples))

    mean_light = white - black
    channels = [
        _Channel(
            np.stack([np.ones_like(black[sampled, i]), black[sampled, i], mean_light[sampled, i]]),
            np.sqrt(np.maximum(white[sampled, i], 1e-2 * white[:, i].max() + 1e-12)),
            unsaturated[sampled, i],
        )
        for i in range(photos.channels)
    ]
    changes = np.empty((len(blacks), len(channels), SHAPES))

    def fit_change(t: int) -> None:
        taken = samples[blacks[t]]
        changes[t] = [channel.change(taken[:, i]) for i, channel in enumerate(channels)]

    side_by_side(fit_change, range(len(blacks)))
    report(len(whites) + 2 * len(blacks))
    # The ambient light at the whites differs from its mean at the blacks; the mean white less that
    # ambient light is the lamp's.
    ambient = np.swapaxes(changes, 1, 2)
    constant, own, share = _between(ambient, blacks, whites.tolist()).mean(axis=0)
    light = (1 - share) * mean_light - constant - own * black
    ambient[:, 2] /= 1 - share
    ambient[:, 0] += ambient[:, 2] * constant
    ambient[:, 1] += ambient[:, 2] * own
    drift = Drift(
        references=references,
        black=_picture(black, photos),
        light=_picture(light, photos),
        unsaturated=unsaturated.reshape(*photos.camera, -1),
        ambient=ambient,
        lamp=np.ones((len(whites), photos.channels)),
    )
    gains, at_samples = np.empty((len(whites), len(channels), 2)), drift.of_pixels(sampled)

    def fit_gain(t: int) -> None:
        # Without the ambient light's drift; the lamp's gain is still 1 here.
        still = at_samples.remove_from_sample(samples[whites[t]], whites[t])
        lit = still - black[sampled]
        gains[t] = [
            channel.gain(lit[:, i], light[sampled, i]) for i, channel in enumerate(channels)
        ]

    side_by_side(fit_gain, range(len(whites)))
    report(2 * len(samples))
    lamp = _lamp(gains, ambient[:, 2], references)
    return Followed(replace(drift, lamp=lamp), samples)


def sampled_pixels(photos: Photos) -> slice:
    """Return the camera pixels, row by row, that fits go by."""
    return slice(None, None, -(-photos.camera.pixels // SAMPLED_PIXELS))


def _lamp(
    gains: NDArray[np.float64], of_white: NDArray[np.float64], references: References
) -> NDArray[np.float64]:
    """Return the lamp at each white.

    Parameters
    ----------
    gains : ndarray, shape (whites, channels, 2)
        With their errors.
    of_white : ndarray, shape (blacks, channels)
        How much of white's light each black holds, less their mean.
    references : References
    """
    gain, error = gains[..., 0], gains[..., 1]
    known = np.all(error < LARGEST_GAIN_ERROR, axis=0)
    lamp: NDArray[np.float64] = np.where(known, gain, 1.0)
    if lamp.min() < LEAST_LAMP:
        # A black that shows white takes its light from the whites beside it.
        if np.ptp(of_white, axis=0).max() > LARGEST_BLACK:
            raise InputError(
                f"photo {references.blacks[of_white.max(axis=1).argmax()]}, of black, shows light "
                f"as white does: put the photos in the order of the plan, or shoot again."
            )
        weakest = references.whites[lamp.min(axis=1).argmin()]
        raise InputError(
            f"photo {weakest}, of white, shows under {LEAST_LAMP:.0%} of the light of the others: "
            f"shoot again with the projector on throughout."
        )
    return np.asarray(lamp / lamp.mean(axis=0))


def _picture(values: Floats, photos: Photos) -> NDArray[np.float32]:
    return values.astype(np.float32).reshape(*photos.camera, -1)


class _Channel(NamedTuple):
    """The data that all fits of a channel share.

    Attributes
    ----------
    shapes : ndarray, shape (3, C)
    scatter : ndarray, shape (C,)
        Standard deviation of a photo's noise, up to a factor.
    usable : ndarray of bool, shape (C,)
    """

    shapes: Floats
    scatter: Floats
    usable: Booleans

    def change(self, photo: Floats) -> NDArray[np.float64]:
        """Return a black photo less the mean black, as multiples of the shapes."""
        return robust_fit(self._whitened(self.shapes), self._whitened(photo - self.shapes[1]))[0]

    def gain(self, photo: Floats, light: Floats) -> tuple[float, float]:
        """Return the lamp's gain at a white photo without ambient light, and its deviation."""
        found, error = robust_fit(self._whitened(light[None]), self._whitened(photo))
        return float(found[0]), error

    def _whitened(self, values: Floats) -> Floats:
        # Divided by the shot noise, which grows with the root of the light.
        return np.asarray((values / self.scatter)[..., self.usable], dtype=np.float64)
