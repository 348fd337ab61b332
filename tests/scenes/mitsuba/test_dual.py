"""Dual views against renders in which the projector and the camera have changed places."""

import numpy as np
import pytest

import nearfar
from nearfar.arrays import Size
from nearfar.scenes.mitsuba.loading import load_scene
from nearfar.scenes.mitsuba.photos import RenderedWorld
from nearfar.scenes.mitsuba.transport import render_transport
from tests.scenes.mitsuba import descriptions as d

SIDE = Size(16, 16)
RUNS, SAMPLES = 8, 256
# Angles and places of the camera and of the projector of these scenes.
CAMERA, PROJECTOR = ("40", "0.3, 0, 4"), ("36", "-0.3, 0.1, 4")
BODY = d.ball(0.4, 0, 0, "") + d.panel('<bsdf type="twosided"><bsdf type="diffuse"/></bsdf>')


def scene(camera, projector, body=BODY):
    """Describe a scene whose camera and projector have these angles and places."""
    placed = [
        text.replace(f'value="{fov}"', f'value="{new_fov}"').replace(place, new_place)
        for text, (fov, place), (new_fov, new_place) in (
            (d.SENSOR, CAMERA, camera),
            (d.PROJECTOR, PROJECTOR, projector),
        )
    ]
    method = d.integrator("path", 5, 9)
    return d.scene(body, method=method, sensor=placed[0], projector=placed[1])


def pixel_area(fov):
    """Of a pixel, at unit distance."""
    return (2 * np.tan(np.radians(float(fov)) / 2) / SIDE.width) ** 2


def views(write, camera, projector, light):
    """Dual views by transports of several seeds, and photos with both changed places."""
    loaded = load_scene(write(scene(camera, projector)), SIDE, SIDE)
    duals = [
        nearfar.dual_view(render_transport(loaded, SAMPLES, seed), light) for seed in range(RUNS)
    ]
    swapped = load_scene(write(scene(projector, camera)), SIDE, SIDE)
    world = RenderedWorld(swapped, SAMPLES)
    lights = np.stack([np.zeros(SIDE, np.float32), light])
    photos = [np.subtract(*world.pictures(lights)[::-1]) for _ in range(RUNS)]
    # A photo is a mean over a pixel, and a light fills one.
    ratio = pixel_area(camera[0]) / pixel_area(projector[0])
    return ratio * np.stack(duals).astype(np.float64), np.stack(photos).astype(np.float64)


def check_alike(one, other):
    """Compare means of 4 x 4 regions, as pixels share paths, with what their scatter tells."""
    regions = [v.reshape(RUNS, 4, 4, 4, 4, 3).mean(axis=(2, 4)) for v in (one, other)]
    means = [region.mean(axis=0) for region in regions]
    noise = np.sqrt(sum(region.var(axis=0, ddof=1) for region in regions) / RUNS)
    seen = means[1] > 1e-3
    z = ((means[0] - means[1]) / np.maximum(noise, 1e-9))[seen]
    share = np.sqrt(np.mean((means[0] - means[1])[seen] ** 2) / np.mean(means[1][seen] ** 2))
    assert np.sqrt(np.mean(z**2)) < 1.5
    assert share < 0.02


def a_light(name):
    if name == "white":
        return np.ones(SIDE, np.float32)
    return np.random.default_rng(5).uniform(0, 1, SIDE).astype(np.float32)


@pytest.mark.slow
@pytest.mark.parametrize("lit", ["white", "random"])
def test_the_dual_view_is_what_a_camera_in_the_projectors_place_sees(write, lit):
    check_alike(*views(write, CAMERA, PROJECTOR, a_light(lit)))


@pytest.mark.slow
def test_a_camera_in_the_projectors_place_sees_its_own_dual_view(write):
    light = a_light("random")
    loaded = load_scene(write(scene(CAMERA, CAMERA)), SIDE, SIDE)
    seen, duals = [], []
    for seed in range(RUNS):
        seen.append(render_transport(loaded, SAMPLES, seed) @ light)
        duals.append(nearfar.dual_view(render_transport(loaded, SAMPLES, RUNS + seed), light))
    check_alike(*(np.stack(pictures).astype(np.float64) for pictures in (duals, seen)))
