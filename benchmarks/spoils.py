"""Ways to spoil a capture, for benchmarks/spoilt_captures.py and the tests.

Index convention: photos are (n, Cy, Cx, channels), in the plan's order.
"""

import io
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image
from scipy import ndimage

from nearfar import ExactTransport, Plan, Size, choose_plan
from nearfar.files import to_srgb
from nearfar.rigs.simulated.camera import SimulatedCamera
from nearfar.rigs.simulated.projector import SimulatedProjector
from nearfar.rigs.simulated.rig import SimulatedRig
from nearfar.scenes.cache import cached_scene

Photos = NDArray[Any]


@dataclass(frozen=True, eq=False)
class Shot:
    """A good capture, and the rig that takes others like it.

    Attributes
    ----------
    truth : ExactTransport
    plan : Plan
    rig : SimulatedRig
    photos : ndarray
    """

    truth: ExactTransport
    plan: Plan
    rig: SimulatedRig
    photos: Photos

    @property
    def full_scale(self) -> float:
        """Value of full scale."""
        return self.rig.full_scale

    @property
    def half(self) -> int:
        """A photo in the middle."""
        return len(self.photos) // 2

    def again(self, change: Callable[[NDArray[np.uint8], int], NDArray[np.floating]]) -> Photos:
        """Shoot patterns that are changed, by number."""
        drawn = [
            np.rint(np.clip(change(self.plan.draw(i), i), 0, 255)).astype(np.uint8)
            for i in range(len(self.photos))
        ]
        return np.stack(list(self.rig.shoot(drawn)))

    def counts(self, values: NDArray[np.floating]) -> Photos:
        """Return values as a camera's counts."""
        return np.rint(np.clip(values, 0, self.full_scale)).astype(self.photos.dtype)

    def middle_of(self, level: float) -> int:
        """Return the photo in the middle of those of black, 0, or white, 1."""
        drawn = [self.plan.draw(number) / 255.0 for number in range(len(self.photos))]
        of_it = [number for number, light in enumerate(drawn) if np.all(light == level)]
        return of_it[len(of_it) // 2]

    def chosen(self, count: int) -> list[int]:
        """Choose some photos of transport."""
        own = [
            number
            for number, pattern in enumerate(self.plan.patterns)
            if pattern.purpose in ("near", "far", "direct") and number > 4
        ]
        return sorted(np.random.default_rng(3).choice(own, count, replace=False).tolist())

    def each(self, change: Callable[[Photos, int], Photos], count: int) -> Photos:
        """Change some photos, by number."""
        photos = self.photos.copy()
        for number in self.chosen(count):
            photos[number] = change(self.photos[number], number)
        return photos


def shoot(scene: str, projector: Size, photos: int, seed: int = 0) -> Shot:
    """Take a good capture of a built-in scene."""
    plan, _ = choose_plan(projector, photos)
    return shoot_plan(scene, plan, seed)


def shoot_plan(scene: str, plan: Plan, seed: int = 0) -> Shot:
    """Take a good capture of a built-in scene with a plan."""
    projector = plan.projector
    truth = cached_scene(scene, projector)
    brightest = float((truth @ np.ones(projector)).max())
    rig = SimulatedRig(truth, scene, SimulatedProjector(), SimulatedCamera(), 0.9 / brightest, seed)
    taken = np.stack(list(rig.shoot([plan.draw(i) for i in range(len(plan.patterns))])))
    return Shot(truth, plan, rig, taken)


@dataclass(frozen=True)
class Spoil:
    """A way to spoil a capture.

    Attributes
    ----------
    apply : callable
        Returns the photos, given the capture and a strength.
    causes : tuple of str
        The right answers.
    strengths : tuple of float
        From weak to strong.
    """

    apply: Callable[[Shot, float], Photos]
    causes: tuple[str, ...]
    strengths: tuple[float, ...]


SPOILS: dict[str, Spoil] = {}


def spoil(name: str, causes: tuple[str, ...], *strengths: float) -> Callable[..., None]:
    """Register a way to spoil a capture."""

    def register(apply: Callable[[Shot, float], Photos]) -> None:
        SPOILS[name] = Spoil(apply, causes, strengths)

    return register


@spoil("gamma", ("not-linear",), 1.02, 1.03, 1.04, 1.1, 2.2)
def _(shot: Shot, gamma: float) -> Photos:
    return shot.counts(shot.full_scale * (shot.photos / shot.full_scale) ** gamma)


@spoil("sRGB encoding, in part", ("not-linear",), 0.05, 0.1, 0.3, 1.0)
def _(shot: Shot, share: float) -> Photos:
    light = shot.photos / shot.full_scale
    return shot.counts(shot.full_scale * ((1 - share) * light + share * to_srgb(light)))


@spoil("black clipped", ("not-linear",), 0.03, 0.05, 0.1)
def _(shot: Shot, share: float) -> Photos:
    return shot.counts(shot.photos - share * shot.full_scale)


@spoil("contrast set by each photo", ("exposure", "not-linear"), 0.02, 0.05, 0.2)
def _(shot: Shot, share: float) -> Photos:
    low, high = np.percentile(shot.photos, [0.5, 99.5], axis=(1, 2, 3), keepdims=True)
    stretched = (shot.photos - low) / (high - low) * 0.95 * shot.full_scale
    return shot.counts((1 - share) * shot.photos + share * stretched)


@spoil("overexposed", ("saturated",), 1.2, 1.35, 1.5)
def _(shot: Shot, gain: float) -> Photos:
    return shot.counts(shot.photos.astype(float) * gain)


@spoil("saturated below full scale", ("saturated",), 0.8, 0.6)
def _(shot: Shot, level: float) -> Photos:
    return shot.counts(np.minimum(shot.photos, level * shot.full_scale))


@spoil("camera moved, pixels", ("moved",), 0.05, 0.1, 0.3, 1.0, 3.0)
def _(shot: Shot, pixels: float) -> Photos:
    photos = shot.photos.astype(float)
    for number in range(shot.half, len(photos)):
        photos[number] = ndimage.shift(photos[number], (0, pixels, 0), order=3, mode="nearest")
    return shot.counts(photos)


@spoil("camera moved for a while, pixels", ("moved",), 0.2, 0.4, 1.0, 2.0)
def _(shot: Shot, pixels: float) -> Photos:
    photos = shot.photos.astype(float)
    for number in range(shot.half // 2, shot.half):
        photos[number] = ndimage.shift(photos[number], (pixels, 0, 0), order=3, mode="nearest")
    return shot.counts(photos)


@spoil("camera moved far, pixels", ("moved",), 2.0, 8.0)
def _(shot: Shot, pixels: float) -> Photos:
    photos = shot.photos.astype(float)
    for number in range(shot.half, len(photos)):
        photos[number] = ndimage.shift(photos[number], (pixels, 0, 0), order=3, mode="nearest")
    return shot.counts(photos)


@spoil("part of the scene moved, pixels", ("moved",), 0.1, 0.2, 0.3, 1.0)
def _(shot: Shot, pixels: float) -> Photos:
    photos = shot.photos.astype(float)
    part = photos.shape[1] // 3
    for number in range(shot.half, len(photos)):
        moved = ndimage.shift(photos[number], (pixels, 0, 0), order=3, mode="nearest")
        photos[number, :part] = moved[:part]
    return shot.counts(photos)


@spoil("projector moved, pixels", ("moved",), 0.05, 0.1, 0.3, 1.0)
def _(shot: Shot, pixels: float) -> Photos:
    def shifted(pattern: NDArray[np.uint8], number: int) -> NDArray[np.floating]:
        by = pixels if number >= shot.half else 0.0
        return ndimage.shift(pattern.astype(float), (0, by), order=1, mode="nearest")

    return shot.again(shifted)


@spoil("projector out of focus, pixels", ("moved", "focus"), 0.35, 0.45, 0.6)
def _(shot: Shot, deviation: float) -> Photos:
    def blurred(pattern: NDArray[np.uint8], number: int) -> NDArray[np.floating]:
        by = deviation if number >= shot.half else 1e-3
        return ndimage.gaussian_filter(pattern.astype(float), by, mode="nearest")

    return shot.again(blurred)


@spoil("camera out of focus, pixels", ("moved", "focus"), 0.3, 0.4, 0.6)
def _(shot: Shot, deviation: float) -> Photos:
    photos = shot.photos.astype(float)
    for number in range(shot.half, len(photos)):
        photos[number] = ndimage.gaussian_filter(photos[number], (deviation, deviation, 0))
    return shot.counts(photos)


@spoil("photos swapped", ("order",), 2, 4)
def _(shot: Shot, count: float) -> Photos:
    photos = shot.photos.copy()
    chosen = shot.chosen(int(count))
    for one, other in zip(chosen[::2], chosen[1::2], strict=True):
        photos[[one, other]] = shot.photos[[other, one]]
    return photos


@spoil("photos rotated", ("turned",), 1, 2, 4)
def _(shot: Shot, count: float) -> Photos:
    return shot.each(lambda photo, _: photo[::-1, ::-1], int(count))


@spoil("photos mirrored", ("turned",), 1, 2, 4)
def _(shot: Shot, count: float) -> Photos:
    return shot.each(lambda photo, _: photo[:, ::-1], int(count))


@spoil("photos doubled", ("order",), 1, 2, 4)
def _(shot: Shot, count: float) -> Photos:
    return shot.each(lambda _, number: shot.photos[number - 1], int(count))


@spoil("one photo late for a while", ("order",), 4, 8)
def _(shot: Shot, count: float) -> Photos:
    photos, last = shot.photos.copy(), 20 + int(count)
    photos[20:last] = shot.photos[19 : last - 1]
    return photos


@spoil("photos torn", ("torn",), 1, 2, 4)
def _(shot: Shot, count: float) -> Photos:
    def torn(photo: Photos, number: int) -> Photos:
        half = len(photo) // 2
        return np.concatenate([photo[:half], shot.photos[number - 1, half:]])

    return shot.each(torn, int(count))


@spoil("photos interlaced", ("torn",), 1, 2, 4)
def _(shot: Shot, count: float) -> Photos:
    def interlaced(photo: Photos, number: int) -> Photos:
        both = photo.copy()
        both[1::2] = shot.photos[number - 1, 1::2]
        return both

    return shot.each(interlaced, int(count))


@spoil("photos cut off", ("torn",), 1, 2)
def _(shot: Shot, count: float) -> Photos:
    def cut_off(photo: Photos, _: int) -> Photos:
        rest = photo.copy()
        rest[len(photo) // 2 :] = 0
        return rest

    return shot.each(cut_off, int(count))


@spoil("all photos in reverse", ("order",), 1)
def _(shot: Shot, _: float) -> Photos:
    return shot.photos[::-1].copy()


@spoil("photos late from the middle on", ("order",), 1, 2)
def _(shot: Shot, late: float) -> Photos:
    photos, by = shot.photos.copy(), int(late)
    photos[shot.half :] = shot.photos[shot.half - by : len(photos) - by]
    return photos


@spoil("highlights compressed", ("not-linear",), 0.7, 0.6, 0.5)
def _(shot: Shot, knee: float) -> Photos:
    light = shot.photos / shot.full_scale
    return shot.counts(shot.full_scale * np.minimum(light, knee + (light - knee) / 2))


@spoil("one black under room light", ("exposure", "lamp"), 0.02, 0.05)
def _(shot: Shot, share: float) -> Photos:
    photos = shot.photos.astype(float)
    photos[shot.middle_of(0.0)] += share * shot.full_scale
    return shot.counts(photos)


@spoil("one white brighter", ("exposure", "lamp"), 0.05, 0.1)
def _(shot: Shot, share: float) -> Photos:
    photos = shot.photos.astype(float)
    photos[shot.middle_of(1.0)] *= 1 + share
    return shot.counts(photos)


@spoil("a hand before one white", ("unknown", "exposure"), 0.5, 1.0)
def _(shot: Shot, share: float) -> Photos:
    photos = shot.photos.astype(float)
    side = photos.shape[1] // 3
    photos[shot.middle_of(1.0), :side, :side] *= 1 - share / 2
    return shot.counts(photos)


@spoil("exposure of three photos", ("exposure",), 0.05, 0.07, 0.1, 0.2)
def _(shot: Shot, share: float) -> Photos:
    return shot.each(lambda photo, _: shot.counts(photo * (1 - share)), 3)


@spoil("photos at a quarter", ("exposure",), 1, 3)
def _(shot: Shot, count: float) -> Photos:
    return shot.each(lambda photo, _: photo // 4, int(count))


@spoil("shadow in three photos", ("unknown",), 0.1, 0.2, 0.5)
def _(shot: Shot, share: float) -> Photos:
    third = shot.plan.projector.width // 3
    chosen = shot.chosen(3)

    def shaded(pattern: NDArray[np.uint8], number: int) -> NDArray[np.floating]:
        light = pattern.astype(float)
        light[:, :third] *= 1 - share * (number in chosen)
        return light

    return shot.again(shaded)


@spoil("patterns mixed in two photos", ("torn", "unknown", "exposure"), 0.1, 0.3)
def _(shot: Shot, share: float) -> Photos:
    def mixed(photo: Photos, number: int) -> Photos:
        return shot.counts((1 - share) * photo + share * shot.photos[number - 1].astype(float))

    return shot.each(mixed, 2)


@spoil("lamp flickers", ("exposure",), 0.01, 0.02, 0.03, 0.05)
def _(shot: Shot, share: float) -> Photos:
    gains = 1 + share * np.random.default_rng(5).standard_normal(len(shot.photos))
    return shot.counts(shot.photos * gains[:, None, None, None])


@spoil("lamp dimmer from the middle on", ("exposure",), 0.03, 0.05, 0.1)
def _(shot: Shot, share: float) -> Photos:
    photos = shot.photos.astype(float)
    photos[shot.half :] *= 1 - share
    return shot.counts(photos)


@spoil("exposure by the mean of a photo", ("exposure",), 0.02, 0.04, 0.08)
def _(shot: Shot, share: float) -> Photos:
    means = shot.photos.mean(axis=(1, 2, 3), keepdims=True) / shot.photos.mean()
    return shot.counts(shot.photos * (means + 0.05) ** -share)


@spoil("black level of each photo", ("exposure",), 0.005, 0.01, 0.02)
def _(shot: Shot, share: float) -> Photos:
    levels = share * shot.full_scale * np.random.default_rng(6).random(len(shot.photos))
    return shot.counts(shot.photos + levels[:, None, None, None])


@spoil("bands of mains light", ("exposure",), 0.01, 0.02, 0.05)
def _(shot: Shot, share: float) -> Photos:
    phases = np.random.default_rng(7).random(len(shot.photos))
    rows = np.linspace(0, 2.3, shot.photos.shape[1])
    bands = 1 + share * np.sin(2 * np.pi * np.add.outer(phases, rows))
    black = shot.photos[0].astype(float)
    return shot.counts(black + (shot.photos - black) * bands[..., None, None])


@spoil("offsets of the camera's rows", ("exposure",), 0.002, 0.004, 0.008)
def _(shot: Shot, share: float) -> Photos:
    offsets = np.random.default_rng(8).standard_normal(shot.photos.shape[:2])
    return shot.counts(shot.photos + share * shot.full_scale * offsets[..., None, None])


@spoil("pixels that flash", ("unknown",), 0.001, 0.003, 0.01)
def _(shot: Shot, share: float) -> Photos:
    rng, photos = np.random.default_rng(9), shot.photos.astype(float)
    flashes = rng.random(photos.shape[:3]) < share
    photos[flashes] += 0.3 * shot.full_scale * rng.random((int(flashes.sum()), 1))
    return shot.counts(photos)


@spoil("dust from the middle on", ("moved",), 0.05, 0.1, 0.3)
def _(shot: Shot, share: float) -> Photos:
    photos = shot.photos.astype(float)
    down, across = np.indices(photos.shape[1:3]) / np.array(photos.shape[1:3])[:, None, None]
    for place in ((0.3, 0.3), (0.6, 0.5), (0.5, 0.7)):
        distance = np.hypot(down - place[0], across - place[1])
        photos[shot.half :] *= (1 - share * np.exp(-((distance / 0.07) ** 2)))[..., None]
    return shot.counts(photos)


@spoil("a window over six photos", ("unknown",), 1)
def _(shot: Shot, _: float) -> Photos:
    height, width = shot.plan.projector

    def covered(pattern: NDArray[np.uint8], number: int) -> NDArray[np.floating]:
        light = pattern.astype(float)
        if shot.half + 3 <= number < shot.half + 9:
            light[-height // 4 : -height // 10, -width // 3 : -width // 16] = 255
        return light

    return shot.again(covered)


@spoil("colours of the lamp from the middle on", ("exposure",), 0.03, 0.05, 0.1)
def _(shot: Shot, share: float) -> Photos:
    photos = shot.photos.astype(float)
    photos[shot.half :] *= [1 + share, 1.0, 1 - share]
    return shot.counts(photos)


@spoil("patterns that linger", ("order",), 0.01, 0.02, 0.04)
def _(shot: Shot, share: float) -> Photos:
    def lingering(pattern: NDArray[np.uint8], number: int) -> NDArray[np.floating]:
        before = shot.plan.draw(max(0, number - 1)).astype(float)
        return np.asarray((1 - share) * pattern + share * before)

    return shot.again(lingering)


@spoil("room light from the middle on", ("exposure", "lamp"), 0.02, 0.05)
def _(shot: Shot, share: float) -> Photos:
    photos = shot.photos.astype(float)
    uneven = np.linspace(0.1, 0.9, photos.shape[2])[:, None]
    photos[shot.half :] += share * shot.full_scale * uneven
    return shot.counts(photos)


@spoil("room light for five photos", ("exposure", "lamp"), 0.02, 0.03, 0.05)
def _(shot: Shot, share: float) -> Photos:
    photos = shot.photos.astype(float)
    photos[22:27] += share * shot.full_scale
    return shot.counts(photos)


@spoil("colours swapped", ("colours",), 1, 2, 4)
def _(shot: Shot, count: float) -> Photos:
    return shot.each(lambda photo, _: photo[..., ::-1], int(count))


@spoil("photos of black", ("order",), 1, 2)
def _(shot: Shot, count: float) -> Photos:
    return shot.each(lambda _, __: shot.photos[0], int(count))


@spoil("JPEG of quality", ("compressed", "not-linear"), 99, 95, 85)
def _(shot: Shot, quality: float) -> Photos:
    def compressed(photo: Photos) -> NDArray[np.floating]:
        stored = io.BytesIO()
        values = np.rint(255.0 * photo / shot.full_scale).astype(np.uint8)
        picture = values[..., 0] if values.shape[2] == 1 else values
        Image.fromarray(picture).save(stored, "JPEG", quality=int(quality))
        read = np.asarray(Image.open(stored), dtype=float)
        return read.reshape(photo.shape) / 255 * shot.full_scale

    return shot.counts(np.stack([compressed(photo) for photo in shot.photos]))
