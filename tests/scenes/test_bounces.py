"""Bounces of a scene against its transport, which is found without them."""

import numpy as np
import pytest

from nearfar import natural_picture, scenes
from nearfar.arrays import Size
from nearfar.errors import InputError
from nearfar.scenes import SCENES
from nearfar.scenes.bounces import exact_bounces
from nearfar.scenes.description import SceneDescription

SMALL = Size(12, 16)


@pytest.mark.parametrize(
    ("name", "camera"),
    [("corner", None), ("corner", Size(9, 20)), ("cornell", None), ("cornell-aside", None)],
)
def test_all_bounces_together_are_the_picture(name, camera):
    """Inter-reflection, a dipole and highlights, from the front and from aside."""
    scene = scenes.build(name, SMALL, camera)
    light = natural_picture(SMALL, 4)[..., None] * np.array([1.0, 0.3, 0.6])
    found = exact_bounces(name, light, 40, SMALL, camera)
    assert found.shape == (40, *scene.camera, 3)
    np.testing.assert_allclose(found.sum(axis=0), scene @ light, atol=1e-6)
    direct, near, far = scene.component_pictures(light)
    np.testing.assert_allclose(found[0], direct + near, atol=1e-6)
    assert far.max() > 1e-2
    assert found.min() >= 0


def test_light_reaches_one_reflection_further_with_each_bounce():
    """Convex walls by themselves: where only one wall is lit, it has no second bounce."""
    scene = scenes.build("wedge", Size(12, 18))
    ground = np.zeros((12, 18))
    ground[-2:] = 1.0
    first, second, third = exact_bounces("wedge", ground, 3, Size(12, 18))
    lit = scene.component_pictures(ground)[0].sum(axis=-1) > 0.05
    assert second[lit].mean() < 0.1 * third[lit].mean()
    assert first[lit].mean() > 100 * second[lit].mean()


def test_faults_are_told(monkeypatch):
    white = np.ones(SMALL)
    with pytest.raises(InputError, match="teapot"):
        exact_bounces("teapot", white, 2, SMALL)
    with pytest.raises(InputError, match="count"):
        exact_bounces("corner", white, 0, SMALL)
    with pytest.raises(InputError, match="the light is 3x3"):
        exact_bounces("corner", np.ones((3, 3)), 2, SMALL)
    described = SceneDescription(
        summary="none", projector=SMALL, compute=lambda *_: scenes.build("corner", SMALL)
    )
    monkeypatch.setattr(type(SCENES), "__getitem__", lambda *_: described)
    with pytest.raises(InputError, match="choose a scene that is computed by radiosity"):
        exact_bounces("own", white, 2, SMALL)
