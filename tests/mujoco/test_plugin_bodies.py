"""Bodies of every kind, under every law, are pressed by the compiled core alone, as the NumPy sensor reads them."""

import mujoco
import numpy as np
import pytest
import trimesh

import mjtactile
from mjtactile.native import without_native
from mjtactile.press_host import PressHost

SOLID = trimesh.creation.icosphere(2, radius=5e-3)
MESH = (
    f'<mesh name="rough" vertex="{" ".join(f"{x:.9g}" for x in SOLID.vertices.ravel())}" '
    f'face="{" ".join(map(str, SOLID.faces.ravel()))}"/>'
)
SMOOTH = {
    "sphere": 'type="sphere" size=".005"',
    "ellipsoid": 'type="ellipsoid" size=".006 .004 .005"',
    "capsule": 'type="capsule" size=".004 .002" quat=".7071 0 .7071 0"',
    "capsule over the edges": 'type="capsule" size=".004 .02" quat=".7071 0 .7071 0"',
    "cylinder over the edges": 'type="cylinder" size=".005 .02" quat=".7071 .7071 0 0"',
    "mesh": 'type="mesh" mesh="rough"',
}
FLAT = {
    "box": 'type="box" size=".003 .004 .005"',
    "cylinder": 'type="cylinder" size=".003 .005"',
    "box over the edge": 'type="box" size=".02 .004 .005" pos=".017 .001 0"',
    "box that leans": 'type="box" size=".003 .004 .005" euler="1.5 -2 10"',
    "mesh": 'type="mesh" mesh="cube"',
}
CUBE = (
    '<mesh name="cube" vertex="-.003 -.003 -.005 .003 -.003 -.005 -.003 .003 -.005 .003 .003 -.005 '
    '-.003 -.003 .005 .003 -.003 .005 -.003 .003 .005 .003 .003 .005"/>'
)


def pressed(geom: str, law: str) -> tuple[mujoco.MjModel, mujoco.MjData]:
    """A body that was pushed onto a pad, and forward kinematics and dynamics of where it came to lie."""
    model = mujoco.MjModel.from_xml_string(f"""<mujoco>
      <compiler angle="degree"/>
      <option timestep=".001" integrator="implicitfast" cone="elliptic"/>
      <extension><plugin plugin="mjtactile.pad"/></extension>
      <asset>{MESH}{CUBE}</asset>
      <worldbody>
        <geom name="pad" type="box" size=".0075 .0075 .0025" pos="0 0 -.0025" priority="10" condim="4" solref=".005 1"/>
        <body name="body" pos=".0006 -.0004 .0055">
          <joint type="slide" axis="0 0 1" damping="1"/><geom {geom} mass=".03"/>
        </body>
      </worldbody>
      <sensor><plugin name="touch" plugin="mjtactile.pad" objtype="geom" objname="pad">
        <config key="fidelity" value="fast"/><config key="law" value="{law}"/>
      </plugin></sensor></mujoco>""")
    data = mujoco.MjData(model)
    for _ in range(60):
        mujoco.mj_step(model, data)
    mujoco.mj_forward(model, data)
    return model, data


@pytest.mark.parametrize(
    ("geom", "law"),
    [(geom, law) for geom in SMOOTH.values() for law in ("elastic", "foundation")]
    + [(geom, law) for geom in FLAT.values() for law in ("elastic", "foundation", "uniform")],
)
@pytest.mark.filterwarnings("ignore::mjtactile.ContactWarning")
def test_read_by_the_core_as_by_the_reference(geom, law, monkeypatch):
    if law == "uniform" and "euler" in geom:
        pytest.skip("the part of a leaning face that law uniform takes to press is cut by the reference")

    def refuse(*_: object) -> None:
        raise AssertionError("the core asked for the reference")

    model, data = pressed(geom, law)
    monkeypatch.setattr(PressHost, "nodal_forces", refuse)
    mujoco.mj_forward(model, data)
    found = data.sensordata.copy()
    assert found.max() > 0.0
    with without_native():
        expected = mjtactile.TactileSensor(model, geom="pad", preset="fast", law=law).read(data).ravel()
    # Cells of flat faces follow the face's own axes here and the outline's first corner there.
    assert np.linalg.norm(found - expected) <= 0.05 * np.linalg.norm(expected)


def read_both_ways(bodies: str) -> None:
    """Let a world with geom `pad` come to rest; what the plugin reads is what the reference does."""
    model = mujoco.MjModel.from_xml_string(f"""<mujoco>
      <option timestep=".001" integrator="implicitfast" cone="elliptic"/>
      <extension><plugin plugin="mjtactile.pad"/></extension>
      <worldbody>{bodies}</worldbody>
      <sensor><plugin name="touch" plugin="mjtactile.pad" objtype="geom" objname="pad">
        <config key="fidelity" value="fast"/></plugin></sensor></mujoco>""")
    data = mujoco.MjData(model)
    for _ in range(60):
        mujoco.mj_step(model, data)
    mujoco.mj_forward(model, data)
    with without_native():
        expected = mjtactile.TactileSensor(model, geom="pad", preset="fast").read(data).ravel()
    assert expected.max() > 0.0
    assert np.linalg.norm(data.sensordata - expected) <= 0.02 * np.linalg.norm(expected)


def test_a_floor_is_a_face_too(monkeypatch):
    """The pad falls on a plane."""
    monkeypatch.setattr(PressHost, "nodal_forces", lambda *_: pytest.fail("the core asked for the reference"))
    read_both_ways("""<geom type="plane" size="1 1 .1"/>
        <body pos="0 0 .00251"><joint type="slide" axis="0 0 1"/>
          <geom name="pad" type="box" size=".0075 .0075 .0025" quat="0 1 0 0" mass=".05" priority="10" condim="4"
            solref=".005 1"/></body>""")


def test_a_jaw_below_the_pad_is_not_what_presses():
    """A clamp whose flat lower jaw reaches under the pad presses with the ball of its upper one."""
    read_both_ways("""
        <geom name="pad" type="box" size=".0075 .0075 .0025" pos="0 0 -.0025" priority="10" condim="4"/>
        <body pos="0 0 .00301"><joint type="slide" axis="0 0 1"/>
          <geom type="sphere" size=".003" mass=".01"/>
          <geom type="box" size=".003 .003 .001" pos="0 0 -.012" mass=".001"/></body>""")
