import numpy as np
import pytest
from scipy import integrate

from nearfar.arrays import Size
from nearfar.scenes import SCENES
from nearfar.scenes.cornell import WAX
from nearfar.scenes.dipole import dipole, subsurface
from nearfar.scenes.geometry import Material, View, quadrilateral
from nearfar.scenes.optics import pinhole
from nearfar.scenes.patches import build_patches, with_medium
from nearfar.scenes.rays import surface
from nearfar.scenes.render import body_of
from nearfar.transport.dipole import diffuse_profile, diffuse_reflectance


@pytest.mark.parametrize("channel", range(3))
def test_closed_form_agrees_with_the_integral(channel):
    source = dipole(WAX.medium, channel)
    for radius in (0.01, 0.1, 2.0):
        integral, _ = integrate.quad(
            lambda r: float(diffuse_profile(source, np.array(r**2))) * 2 * np.pi * r, 0, radius
        )
        assert diffuse_reflectance(source, radius) == pytest.approx(integral, rel=1e-6)


@pytest.mark.parametrize("channel", range(3))
def test_total_reflectance_is_jensens(channel):
    """Jensen et al. (2001), R_d as a function of the reduced albedo alone."""
    medium = WAX.medium
    source = dipole(medium, channel)
    alpha = source.reduced_albedo
    fresnel = -1.440 / medium.index**2 + 0.710 / medium.index + 0.668 + 0.0636 * medium.index
    mismatch = (1 + fresnel) / (1 - fresnel)
    root = np.sqrt(3 * (1 - alpha))
    known = alpha / 2 * (1 + np.exp(-4 / 3 * mismatch * root)) * np.exp(-root)
    assert diffuse_reflectance(source) == pytest.approx(known, rel=1e-9)
    assert known + WAX.albedo[channel] < 1


def test_patch_matrix_returns_the_total_in_the_middle_of_a_plane():
    """Summed over the patches, one patch's light is the closed form; also at coarse sizes."""
    parts = [
        quadrilateral(
            "plane", (-1.0, -1.0, 0.0), (2.0, 0.0, 0.0), (0.0, 2.0, 0.0), Material((1.0,) * 3)
        )
    ]
    for size in (Size(12, 12), Size(25, 25)):
        eye = pinhole(View((0.0, 0.0, 4.0), (0.0, 0.0, 0.0), 0.08), size)
        patches = build_patches(surface(parts, [0]), parts, eye, size)
        source = dipole(WAX.medium, 0)
        matrix = subsurface(patches, source)
        np.testing.assert_array_equal(matrix, matrix.T)
        assert np.linalg.eigvalsh(matrix)[0] > -1e-6 * matrix.max()
        middle = np.linalg.norm(patches.centre, axis=1).argmin()
        total = matrix[middle] @ patches.area
        assert total == pytest.approx(diffuse_reflectance(source), rel=0.02)


@pytest.mark.parametrize(
    ("name", "size"),
    [
        ("shelf", Size(10, 10)),
        ("alcove", Size(8, 8)),
        ("hand", Size(9, 9)),
        ("marble", Size(7, 7)),
    ],
)
def test_patch_matrix_is_positive_definite_on_a_coarse_grid(name, size):
    """Where a sample seen at a glancing angle stands for more than its true area."""
    scene = SCENES[name].compute.surfaces()
    everything = surface(scene.parts, range(len(scene.parts)))
    patches = build_patches(everything, scene.parts, pinhole(scene.projector_view, size), size)
    body = body_of(patches, np.flatnonzero(with_medium(patches, scene.parts)))
    material = scene.parts[body.part[0]].material
    for channel in range(3):
        matrix = subsurface(body, dipole(material.medium, channel))
        matrix += np.diag(material.albedo[channel] / body.area)
        assert np.linalg.eigvalsh(matrix)[0] > 0
