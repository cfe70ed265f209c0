"""Hands of the catalogue: their tables, on the models they are for where these are here, and on stand-ins elsewhere."""

from __future__ import annotations

from dataclasses import replace
from importlib.util import find_spec
from pathlib import Path
from typing import Any, cast

import mujoco
import numpy as np
import pytest
from pads_on_bodies import surface_in_body

import mjtactile.attach
from mjtactile.errors import SceneError
from mjtactile.hands import HANDS, Hand, HandPad, attach_hand, check_model, hand
from mjtactile.sim.pad_check import check_pad_geom

HAS_SHADOW = find_spec("gymnasium_robotics") is not None
needs_shadow = pytest.mark.skipif(not HAS_SHADOW, reason="gymnasium-robotics, which brings the hand, is not installed")
#: Of models that the tests make up: fingers' bones are anything, pads are what is looked at.
KINDS = {"box": mujoco.mjtGeom.mjGEOM_BOX, "capsule": mujoco.mjtGeom.mjGEOM_CAPSULE}


@pytest.fixture
def geoms_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    """Pads without sensors: where they stand is looked at, and no table is built."""
    monkeypatch.setattr(mjtactile.attach, "add_pad_sensor", lambda *_: None)


def shadow_files() -> Path:
    package = find_spec("gymnasium_robotics")
    assert package is not None
    assert package.origin is not None
    return Path(package.origin).parent / "envs" / "assets" / "hand"


def stand_in(chosen: Hand, prefix: str = "") -> mujoco.MjSpec:
    """Bodies of a hand, one beside the other, with the geoms that its table knows of."""
    spec = mujoco.MjSpec()
    for number, body in enumerate(dict.fromkeys(one.body for one in chosen.pads)):
        made = spec.worldbody.add_body(name=prefix + body, pos=[0.2 * number, 0, 0])
        made.add_joint(type=mujoco.mjtJoint.mjJNT_SLIDE)
        for geom in chosen.expects:
            if geom.body == body:
                size = [*geom.size, 0.0][:3]
                made.add_geom(type=KINDS[geom.kind], size=size, pos=list(geom.pos))
        if not made.geoms:
            made.add_geom(type=mujoco.mjtGeom.mjGEOM_SPHERE, size=[1e-3, 0, 0])
    return spec


@pytest.mark.parametrize("name", HANDS)
def test_a_hand_has_hundreds_of_taxels_on_pads_with_names_of_their_own(name):
    chosen = hand(name)
    assert 200 <= chosen.taxels <= 1000
    assert len({one.name for one in chosen.pads}) == len(chosen.pads)
    assert {one.shape for one in chosen.pads} == set(chosen.proud)
    assert all(low >= 0 and high >= low for low, high in chosen.proud.values())
    # What a file is known by: its checksum, or the geoms under the pads.
    assert chosen.hashes or chosen.expects


@pytest.mark.parametrize("name", HANDS)
@pytest.mark.parametrize("prefix", ["", "right_"])
def test_one_call_attaches_every_pad_where_the_table_says(name, prefix, geoms_alone):
    chosen = hand(name)
    spec = stand_in(chosen, prefix)
    added = attach_hand(spec, name, prefix=prefix)
    assert list(added) == [prefix + one.name for one in chosen.pads]
    model = spec.compile()
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    for one in chosen.pads:
        check_pad_geom(model, model.geom(f"{prefix}{one.name}_pad").id, one.pad)
        body, site = data.body(prefix + one.body), data.site(f"{prefix}{one.name}_surface")
        np.testing.assert_allclose(site.xpos - body.xpos, one.pos, atol=1e-12)
        # As soft or stiff as the table says, and nothing of the model's own.
        assert model.geom(f"{prefix}{one.name}_pad").margin[0] == (1e-3 if chosen.contact == "soft" else 0.0)


def geoms_under(name: str) -> list[tuple[mujoco.MjModel, HandPad]]:
    """Models whose geoms a hand's pads stand over: real ones where they are here, else what the table expects."""
    chosen = hand(name)
    if name == "shadow":
        if not HAS_SHADOW:
            return []
        model = mujoco.MjModel.from_xml_path(str(shadow_files() / "reach.xml"))
        return [(model, one) for one in chosen.pads]
    model = stand_in(chosen).compile()
    # LEAP's tips collide as meshes, which are not here.
    return [(model, one) for one in chosen.pads if (name, one.shape) != ("leap", "tip")]


def heights_over_geoms(model: mujoco.MjModel, one: HandPad) -> np.ndarray:
    """How far points of a pad's surface stand over the colliding geoms of its body, along the normals [m]."""
    points, normals = surface_in_body(one)
    body, found = model.body(one.body), np.full(len(points), np.inf)
    for geom in range(int(body.geomadr[0]), int(body.geomadr[0]) + int(body.geomnum[0])):
        if not model.geom_contype[geom] and not model.geom_conaffinity[geom]:
            continue
        axes = np.empty(9)
        mujoco.mju_quat2Mat(axes, model.geom_quat[geom])
        for k, (point, normal) in enumerate(zip(points, normals, strict=True)):
            far = mujoco.mju_rayGeom(
                model.geom_pos[geom], axes, model.geom_size[geom], point + 0.02 * normal, -normal, model.geom_type[geom]
            )
            if far >= 0:
                found[k] = min(found[k], far - 0.02)
    return found[np.isfinite(found)]


@pytest.mark.parametrize("name", ["shadow", "allegro", "robotiq_2f85", "leap"])
def test_surfaces_stand_over_what_collides_as_far_as_the_table_says(name):
    looked_at = geoms_under(name)
    if not looked_at:
        pytest.skip("gymnasium-robotics, which brings the hand, is not installed")
    for model, one in looked_at:
        low, high = hand(name).proud[one.shape]
        over = heights_over_geoms(model, one)
        assert len(over) > 300  # of 441: the rest lies beyond the geoms
        assert over.min() >= low - 2e-6, (one.name, over.min())
        assert over.max() <= high + 2e-6, (one.name, over.max())


@needs_shadow
def test_shadows_pads_face_where_fingers_bend_and_keep_clear_of_one_another(geoms_alone):
    spec = mujoco.MjSpec.from_file(str(shadow_files() / "reach.xml"))
    added = attach_hand(spec, "shadow")
    assert len(added) == 18
    model = spec.compile()
    straight, bent = mujoco.MjData(model), mujoco.MjData(model)
    for finger in ("FF", "MF", "RF", "LF"):
        for joint in (0, 1, 2):
            bent.joint(f"robot0:{finger}J{joint}").qpos = 0.05
    bent.joint("robot0:THJ0").qpos = bent.joint("robot0:THJ1").qpos = -0.05
    for data in (straight, bent):
        mujoco.mj_forward(model, data)
    for name in added:
        if "palm" in name:
            continue
        moved = bent.site(f"{name}_surface").xpos - straight.site(f"{name}_surface").xpos
        assert moved @ straight.site(f"{name}_surface").xmat.reshape(3, 3)[:, 2] > 0.75 * np.linalg.norm(moved)
    geoms = [model.geom(f"{name}_pad").id for name in added]
    for k, one in enumerate(geoms):
        for other in geoms[k + 1 :]:
            assert mujoco.mj_geomDistance(model, straight, one, other, 0.01, None) > 5e-4


@needs_shadow
def test_a_file_is_known_by_its_checksum(tmp_path):
    check_model("shadow", shadow_files() / "robot.xml")
    changed = tmp_path / "robot.xml"
    changed.write_bytes((shadow_files() / "robot.xml").read_bytes() + b" ")
    with pytest.raises(SceneError, match=r"another version of robot.xml than the table of hand 'shadow'"):
        check_model("shadow", changed)
    with pytest.raises(SceneError, match=r"cannot read .*Get it from pip install gymnasium-robotics"):
        check_model("shadow", tmp_path / "nowhere" / "robot.xml")
    with pytest.raises(SceneError, match=r"knows no file 'hand.xml'. Known: robot.xml"):
        check_model("shadow", "hand.xml")
    with pytest.raises(SceneError, match="Known: none; it belongs to mujoco_menagerie"):
        check_model("leap", "right_hand.xml")


def test_another_version_of_a_model_is_refused_before_anything_is_attached(geoms_alone):
    allegro = hand("allegro")
    thicker = [replace(one, size=(0.011, *one.size[1:])) if one.body == "th_tip" else one for one in allegro.expects]
    spec = stand_in(replace(allegro, expects=tuple(thicker)))
    with pytest.raises(SceneError, match=r"body 'th_tip' has no capsule of size .*another version of mujoco_menagerie"):
        attach_hand(spec, "allegro")
    assert not any(geom.name.endswith("_pad") for geom in spec.geoms)
    assert list(attach_hand(spec, "allegro", only=["ff_tip", "palm"])) == ["ff_tip", "palm"]


def test_what_is_not_there_is_named(geoms_alone):
    with pytest.raises(SceneError, match=r"hand 'barrett' does not exist. Available: allegro, .*shadow"):
        hand("barrett")
    spec = stand_in(hand("panda"))
    with pytest.raises(SceneError, match=r"no body 'x_finger_joint1_tip', which hand 'panda' has: robosuite"):
        attach_hand(spec, "panda", prefix="x_")
    with pytest.raises(SceneError, match=r"hand 'panda' has no pad 'thumb'. Available: finger1, finger2"):
        attach_hand(spec, "panda", only=["thumb"])
    with pytest.raises(SceneError, match=r"hand \['a'\] does not exist"):
        hand(cast(Any, ["a"]))
    for wrong in ("finger1", 3, ["zz", 3], b"finger1"):
        with pytest.raises(SceneError, match=r"only = .*; expected names of pads, such as \['finger1'\]"):
            attach_hand(spec, "panda", only=cast(Any, wrong))
    with pytest.raises(SceneError, match="prefix is of type NoneType; expected a str"):
        attach_hand(spec, "panda", prefix=cast(Any, None))
    with pytest.raises(SceneError, match="path is of type NoneType; expected the path of the model's file"):
        check_model("panda", cast(Any, None))
    for wrong in (None, 3):
        with pytest.raises(SceneError, match="name is of type"):
            check_model(cast(Any, wrong), "x")
        with pytest.raises(SceneError, match=r"name is of type \w+; expected a mjtactile.Hand: or its name, see HANDS"):
            attach_hand(spec, cast(Any, wrong))


def test_names_that_can_be_read_only_once_are_attached_all(geoms_alone):
    spec = stand_in(hand("panda"))
    assert list(attach_hand(spec, "panda", only=iter(["finger2", "finger1"]))) == ["finger1", "finger2"]


def test_pads_of_one_name_are_refused_before_any_is_attached(geoms_alone):
    panda = hand("panda")
    spec = stand_in(panda)
    with pytest.raises(SceneError, match="hand 'panda' has several pads 'finger1'"):
        attach_hand(spec, replace(panda, pads=tuple(replace(one, name="finger1") for one in panda.pads)))
    assert not any(geom.name.endswith("_pad") for geom in spec.geoms)


def test_the_page_lists_the_catalogue_as_it_is():
    from mjtactile.cli.hands_tables import hands_tables

    page = (Path(__file__).parents[2] / "docs" / "hands.md").read_text()
    assert hands_tables() in page, "run: mjtactile hands --page docs/hands.md"
