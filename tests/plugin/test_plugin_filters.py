"""Which geoms of a body press: those that MuJoCo lets collide with the pad, or those that are named for it."""

import mujoco
import pytest

_PAD = '<geom name="pad" type="box" size=".0075 .0075 .0025" pos="0 0 -.0025"/>'
_CORE = '<geom name="core" type="box" size=".004 .003 .004" mass=".05"/>'
_TIP = '<geom name="tip" type="sphere" size=".002" pos="0 0 -.004" mass=".001"/>'
_JOINT = '<joint type="slide" axis="0 0 1"/>'


def reading(world: str, more: str = "") -> float:
    """Largest reading of a pad in a world after some steps [Pa]."""
    model = mujoco.MjModel.from_xml_string(f"""<mujoco><option timestep=".001" integrator="implicitfast"/>
      <extension><plugin plugin="mjtactile.pad"/></extension><worldbody>{world}</worldbody>{more}
      <sensor><plugin plugin="mjtactile.pad" objtype="geom" objname="pad"><config key="fidelity" value="fast"/></plugin>
      </sensor></mujoco>""")
    data = mujoco.MjData(model)
    mujoco.mj_step(model, data, 200)
    return float(data.sensordata.max())


def welded(geoms: str) -> str:
    return f'<body name="finger">{_PAD}</body><body name="object" pos="0 0 .00401">{_JOINT}{geoms}</body>'


def test_geoms_of_excluded_bodies_do_not_press():
    pair = '<pair geom1="core" geom2="pad"/>'
    alone = reading(welded(_CORE), f"<contact>{pair}</contact>")
    assert alone > 1e3
    both = reading(welded(_CORE + _TIP), f'<contact>{pair}<exclude body1="object" body2="finger"/></contact>')
    assert both == pytest.approx(alone, rel=0.05)  # the tip weighs 2 %
    assert reading(welded(_CORE + _TIP)) > 2.0 * alone


@pytest.mark.parametrize("filters", [True, False])
def test_geoms_that_the_parent_filter_keeps_off_do_not_press(filters):
    def world(geoms: str) -> str:
        inner = f'<body name="object" pos="0 0 .00401">{_JOINT}{geoms}</body>'
        return f'<body name="finger">{_JOINT}{_PAD}{inner}</body>'

    flag = "" if filters else '<option><flag filterparent="disable"/></option>'
    weld = '<equality><weld body1="finger" body2="world"/></equality>'
    more = f'<contact><pair geom1="core" geom2="pad"/></contact>{weld}{flag}'
    alone, both = reading(world(_CORE), more), reading(world(_CORE + _TIP), more)
    assert alone > 1e3
    assert both == pytest.approx(alone, rel=0.05) if filters else both > 2.0 * alone


@pytest.mark.parametrize("ending", ["_tactile", "_tactile0", "_tactile_12"])
def test_geoms_named_for_it_press_whatever_their_number(ending):
    foot = '<geom name="foot{}" type="box" size=".001 .001 .004" pos="{} 0 0" contype="0" conaffinity="0"/>'
    feet = "".join(foot.format(f"{k}{ending}", x) for k, x in (("l", -0.003), ("r", 0.003)))
    hull = reading(welded(_CORE))
    assert reading(welded(_CORE + feet)) > 1.3 * hull
    other = feet.replace("_tactile", "_tactile_left")
    assert reading(welded(_CORE + other)) == pytest.approx(hull, rel=0.05)
