"""The recipe of docs/hands.md for the Shadow hand, as printed, and every fingertip pressed by a ball."""

from __future__ import annotations

import re
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pytest

import mjtactile

pytestmark = pytest.mark.skipif(
    find_spec("gymnasium_robotics") is None, reason="gymnasium-robotics, which brings the hand, is not installed"
)
PAGE = Path(__file__).resolve().parents[2] / "docs" / "hands.md"
PADS = ("ff", "mf", "rf", "lf", "th")


@pytest.fixture(scope="module")
def recipe() -> dict[str, Any]:
    """What the section's code leaves behind."""
    section = PAGE.read_text().split("## Shadow hand (gymnasium-robotics)")[1].split("\n## ")[0]
    names: dict[str, Any] = {}
    for block in re.findall(r"```python\n(.*?)```", section, flags=re.DOTALL):
        exec(compile(block, str(PAGE), "exec"), names)
    return names


def pads_frame(data: mujoco.MjData, pad: str) -> np.ndarray:
    return data.site(f"{pad}_surface").xmat.reshape(3, 3)


def test_the_page_presses_the_index_finger(recipe):
    assert set(recipe["touch"]) == set(PADS)
    assert all((readings == 0).all() for readings in recipe["touch"].values())
    assert recipe["readings"][0].max() > 1e4
    assert (recipe["row"], recipe["column"]) == (6, 8)
    np.testing.assert_allclose(recipe["wrench"][2], -0.5, rtol=0.02)


@pytest.mark.parametrize("pad", PADS)
@pytest.mark.parametrize("off", [-2e-3, 3e-3])
def test_each_pad_feels_a_ball_pressed_to_it_and_where(recipe, pad, off):
    model = recipe["ball_against"](recipe["shadow_hand"](fidelity="fast"), pad, off=off)
    data = recipe["pressed"](model, 0.4)
    wrench = mjtactile.TactileSensor(model, pad).wrench(data)
    along = data.xaxis[model.joint("slide").id] @ pads_frame(data, pad) @ wrench[:3]
    assert along == pytest.approx(0.4, rel=1e-3)
    assert wrench[2] == pytest.approx(-0.4, rel=0.05)  # the hand gives way a little, and the pad leans
    place = wrench[4] / -wrench[2]
    assert place == pytest.approx(off, abs=1.5e-3)
    readings = data.sensor(pad).data.reshape(4, 13, 13)
    assert readings[1].argmax() % 13 == np.abs(mjtactile.Pad().grid.x - place).argmin()
    for other in set(PADS) - {pad}:
        assert (data.sensor(other).data == 0).all()


def test_pads_face_the_palms_side_and_stand_proud_of_the_phalanx(recipe):
    model = recipe["shadow_hand"](fidelity="fast").compile()
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    closed = mujoco.MjData(model)
    for finger in ("FF", "MF", "RF", "LF"):
        closed.joint(f"robot0:{finger}J2").qpos = 0.1
    closed.joint("robot0:THJ0").qpos = -0.1
    mujoco.mj_forward(model, closed)
    for pad in PADS:
        normal = pads_frame(data, pad)[:, 2]
        bent = closed.site(f"{pad}_surface").xpos - data.site(f"{pad}_surface").xpos
        assert bent @ normal > 0.8 * np.linalg.norm(bent)  # flexing moves the pad where it faces
        phalanx = model.geom(f"robot0:C_{pad}distal")
        above = (data.site(f"{pad}_surface").xpos - data.geom(phalanx.name).xpos) @ normal
        assert 1e-3 < above - phalanx.size[0] < 2e-3
        assert model.geom(f"{pad}_pad").margin == 0
