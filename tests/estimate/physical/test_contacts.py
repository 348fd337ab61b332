"""Where translucent bodies touch something opaque, on synthetic transports that are known."""

from dataclasses import replace

import numpy as np
import pytest

from nearfar.estimate.physical.contacts import without_contacts
from nearfar.illumination.near_basis import NearBasis
from nearfar.illumination.pictures import random_pattern
from tests.estimate.physical.even import (
    CAMERA,
    PROJECTOR,
    WHITE,
    body_of,
    places,
    split_of,
    transport_of,
)

# Columns from which on camera pixels are contacts, and then see the wall.
CONTACT, WALL = 6, 8
COLUMNS = np.tile(np.arange(CAMERA.width), (CAMERA.height, 1))
CONTACTS = (COLUMNS >= CONTACT) & (COLUMNS < WALL)
S_BODY, I_BODY, I_WALL = 0.35, 0.05, 0.1
TOTAL = 0.6


def wax_that_touches_a_wall(*, light=0.08, left=0.01, contacts=CONTACTS, of_wall=I_WALL, q=None):
    """Return a split of wax and a wall, both as bright, and contacts that are taken for wax.

    Parameters
    ----------
    light, left : float
        Subsurface light that contacts are said to have, and the inter-reflection left.
    contacts : ndarray of bool, shape (Cy, Cx)
    of_wall : float
        Inter-reflection of the wall.
    q : ndarray, shape (Cy, Cx, 2), optional
    """
    q = places() if q is None else q
    of_body = (COLUMNS < CONTACT) | contacts
    subsurface = np.where(contacts, light, np.where(of_body, S_BODY, 0.0))
    rest = np.where(contacts, left, np.where(of_body, I_BODY, of_wall))
    # The transport has direct light and all else apart.
    transport = transport_of(TOTAL - subsurface - rest, subsurface + rest, q)
    split = split_of(transport, body_of(of_body, q, subsurface))
    # Bodies have less direct light than the transport.
    less = np.where(of_body[..., None], 0.01, 0.0).astype(np.float32)
    return replace(split, direct=split.direct - less)


def of_body(split):
    seen = np.zeros(CAMERA, bool)
    seen.ravel()[split.bodies[0].pixels] = True
    return seen


def test_contacts_with_little_light_of_the_body_and_no_inter_reflection_leave_it():
    before = wax_that_touches_a_wall()
    split = without_contacts(before)
    np.testing.assert_array_equal(of_body(split), COLUMNS < CONTACT)
    transport, light = split.transport, random_pattern(PROJECTOR, 1)
    of_model, parts = transport.components(light), split.components(light)
    np.testing.assert_array_equal(parts.subsurface[CONTACTS], 0.0)
    # They have the model's direct light again, and all else is inter-reflection.
    np.testing.assert_allclose(parts.direct[CONTACTS], of_model.direct[CONTACTS], atol=1e-6)
    np.testing.assert_allclose(sum(parts), transport @ light, atol=1e-6)
    for part, was in zip(parts, before.components(light), strict=True):
        np.testing.assert_allclose(part[~CONTACTS], was[~CONTACTS], atol=1e-6)


ROWS = COLUMNS.T
INSIDE = (ROWS == 6) & (COLUMNS == CONTACT - 2)


def test_contacts_that_meet_at_corners_leave_the_body_together():
    corner = INSIDE | (ROWS == 5) & (COLUMNS == CONTACT - 1)
    split = without_contacts(wax_that_touches_a_wall(contacts=corner))
    np.testing.assert_array_equal(of_body(split), (COLUMNS < CONTACT) & ~corner)


@pytest.mark.parametrize(
    "case",
    [
        pytest.param({"light": 0.2}, id="the body's own light"),
        pytest.param({"left": 0.05}, id="inter-reflection as around"),
        pytest.param({"of_wall": 0.0}, id="no inter-reflection around"),
        pytest.param({"contacts": INSIDE}, id="within the body"),
    ],
)
def test_what_is_no_contact_stays(case):
    before = wax_that_touches_a_wall(**case)
    split = without_contacts(before)
    np.testing.assert_array_equal(of_body(split), of_body(before))
    np.testing.assert_array_equal(split.direct, before.direct)


def test_a_body_with_nothing_opaque_around_stays():
    q = places()
    q[:, WALL:] = np.nan
    before = wax_that_touches_a_wall(q=q)
    np.testing.assert_array_equal(of_body(without_contacts(before)), of_body(before))


def test_a_body_of_outlines_alone_and_no_body_at_all_stay():
    q, column = places(), COLUMNS == CONTACT
    transport = transport_of(np.full(CAMERA, 0.5), np.full(CAMERA, 0.1), q)
    thin = split_of(transport, body_of(column, q, 0.01))
    np.testing.assert_array_equal(of_body(without_contacts(thin)), column)
    assert without_contacts(split_of(transport)).bodies == ()


def test_contacts_have_the_footprint_of_the_transport_again():
    def squares(length):
        return np.broadcast_to(np.float32([length, length, 0, 0]), (*CAMERA, 4))

    before = wax_that_touches_a_wall()
    near = np.zeros((*CAMERA, 1, NearBasis(9, 4).count), np.float32)
    transport = replace(before.transport, pitch=4, near=near, footprint=squares(1.25))
    split = without_contacts(replace(before, transport=transport, footprint=squares(1.0)))
    assert split.footprint is not None
    expected = np.where(CONTACTS[..., None], squares(1.25), squares(1.0))
    np.testing.assert_array_equal(split.footprint, expected)


@pytest.mark.parametrize(("finer", "leave"), [(1, False), (2, True)])
def test_what_is_around_lies_within_cells_as_the_camera_sees_them(finer, leave):
    q = places() / finer
    beside = (COLUMNS >= WALL) & (COLUMNS < WALL + 3)
    q[beside] = np.nan
    before = wax_that_touches_a_wall(q=q)
    left = of_body(before) & ~of_body(without_contacts(before))
    np.testing.assert_array_equal(left, CONTACTS & leave)


@pytest.mark.parametrize(
    ("light", "left", "stays"),
    [(0.15, 0.03, False), (0.15, 0.08, True), (0.3, 0.03, True)],
    ids=["a gap", "inter-reflection as around", "much light under its surface"],
)
def test_a_body_that_is_nothing_but_a_contact_goes(light, left, stays):
    q, seen = places(), (COLUMNS >= 4) & (COLUMNS < 7)
    subsurface, rest = np.where(seen, light, 0.0), np.where(seen, left, I_WALL)
    transport = transport_of(TOTAL - subsurface - rest, subsurface + rest, q)
    before = split_of(transport, body_of(seen, q, subsurface))
    split = without_contacts(before)
    assert len(split.bodies) == stays
    under = split.components(WHITE).subsurface
    np.testing.assert_allclose(under, subsurface * stays, rtol=1e-3, atol=1e-6)
    np.testing.assert_array_equal(split.direct, before.direct)
