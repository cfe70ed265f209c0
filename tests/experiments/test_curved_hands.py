"""Our own hands with curved fingertips: the same hands, but for the pads' geoms."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest

from mjtactile.experiments.hands.fingertip import CURVED_PADS, HandModel
from mjtactile.experiments.hands.gripper import GRIPPER
from mjtactile.experiments.hands.hand import HAND, HAND_PADS
from mjtactile.sim.pad_check import check_pad_geom
from mjtactile.sim.wrench import geom_frame


def without_sensors(hand: HandModel) -> mujoco.MjModel:
    """Where pads stand is looked at, and no table is built."""
    root = hand.document("curved", CURVED_PADS)
    for name in ("sensor", "extension"):
        found = root.find(name)
        assert found is not None
        root.remove(found)
    from mjtactile.sim.mjcf import text_of

    return mujoco.MjModel.from_xml_string(text_of(root))


@pytest.mark.parametrize(("hand", "names"), [(HAND, tuple(HAND_PADS)), (GRIPPER, ("left", "right"))])
def test_every_fingertip_is_a_dome_where_the_flat_pad_stood(hand, names):
    flat, curved = mujoco.MjModel.from_xml_string(hand.mjcf()), without_sensors(hand)
    here, there = mujoco.MjData(curved), mujoco.MjData(flat)
    mujoco.mj_forward(curved, here)
    mujoco.mj_forward(flat, there)
    for name in names:
        geom = curved.geom(f"{name}_pad").id
        check_pad_geom(curved, geom, CURVED_PADS.pad)
        found, expected = geom_frame(curved, here, geom), geom_frame(flat, there, flat.geom(f"{name}_pad").id)
        np.testing.assert_allclose(found.position, expected.position, atol=1e-11)
        np.testing.assert_allclose(found.rotation, expected.rotation, atol=1e-9)  # axes are written with nine digits
        np.testing.assert_array_equal(curved.geom(geom).friction, flat.geom(f"{name}_pad").friction)
    # Domes of 15 x 15 mm are lighter than boxes of the same thickness.
    assert 0.8 * flat.body_mass.sum() < curved.body_mass.sum() < flat.body_mass.sum()
