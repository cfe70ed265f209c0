"""Flexes whose contact forces MuJoCo does not tell: pads say that they do not feel them."""

import mujoco
import numpy as np
import pytest
from mujoco_versions import since

import mjtactile
from mjtactile.errors import ContactWarning

#: A cloth of 20 g, and a block of the same mass.
CLOTH = """<flexcomp name="c" type="grid" dim="2" count="5 5 1" spacing=".003 .003 .003" pos="0 0 .0012" radius=".001"
  mass=".02"><edge equality="true"/><contact selfcollide="none" {contact}/></flexcomp>"""
BLOCK = CLOTH.replace('dim="2"', 'dim="3"').replace('"5 5 1"', '"4 4 2"').replace(".0012", ".0027")
WEIGHT = 0.02 * 9.81  # [N]


def settled(flex: str, flag: str = "") -> tuple[mujoco.MjModel, mujoco.MjData]:
    model = mujoco.MjModel.from_xml_string(f"""<mujoco><extension><plugin plugin="mjtactile.pad"/></extension>
      <option timestep=".0005" integrator="discrete" solver="CG"><flag {flag}/></option><worldbody>
      <geom name="pad" type="box" size=".0075 .0075 .0025" pos="0 0 -.0025" priority="1" solref=".005 1"/>{flex}
      </worldbody><sensor><plugin name="touch" plugin="mjtactile.pad" objtype="geom" objname="pad">
        <config key="fidelity" value="fast"/><config key="output" value="wrench"/></plugin></sensor></mujoco>""")
    data = mujoco.MjData(model)
    mujoco.mj_step(model, data, 400)
    return model, data


def carried(data: mujoco.MjData) -> float:
    """Force that the pad's sensor reports, towards the pad [N]."""
    return -float(data.sensordata[2])


def lies_on_the_pad(data: mujoco.MjData) -> bool:
    return bool((np.abs(data.flexvert_xpos[:, 2] - 0.001) < 2e-4).any()) and float(np.abs(data.qvel).max()) < 0.05


@since("3.14", "its integrators with passive contacts are others")
@pytest.mark.parametrize("flex", [CLOTH, BLOCK])
def test_a_flex_with_passive_contacts_is_not_felt_and_that_is_told(flex):
    active = settled(flex.format(contact=""))[1]
    assert carried(active) == pytest.approx(WEIGHT, rel=0.1)  # it still swings a little
    with pytest.warns(ContactWarning, match=r"pad 'pad': a flex .* is not felt.*leave the attribute out"):
        model, passive = settled(flex.format(contact='passive="true"'))
    assert passive.ncon > 0
    assert carried(passive) == 0.0
    with pytest.warns(ContactWarning, match="is not felt"):  # asked from Python, too
        mjtactile.TactileSensor(model, geom="pad", fidelity="fast").read(passive)


@since("3.14", "it has no flag ipc")
def test_a_cloth_under_flag_ipc_is_not_felt_and_that_is_told():
    flag = 'ipc="enable"'
    with pytest.warns(ContactWarning, match="is not felt.*two-dimensional flexes under <flag ipc"):
        data = settled(CLOTH.format(contact=""), flag)[1]
    assert lies_on_the_pad(data)
    assert carried(data) == 0.0
    settled(CLOTH.format(contact='contype="0" conaffinity="0"'), flag)  # it cannot touch: a warning would be an error
    assert carried(settled(BLOCK.format(contact=""), flag)[1]) == pytest.approx(WEIGHT, rel=0.1)
