"""One press, four sensors: and which of them report the force.

A box is pushed onto a pad with forces that are known. On the same pad in the same step: mjtactile, MuJoCo's `touch`,
its plugin `touch_grid` and its `<tactile>`.
"""

import mujoco
import numpy as np

import mjtactile

SCENE = """
<mujoco>
  <extension>
    <plugin plugin="mjtactile.pad"/>
    <plugin plugin="mujoco.sensor.touch_grid"/>
  </extension>
  <option timestep="0.001" integrator="implicitfast" cone="elliptic" impratio="100" gravity="0 0 0"/>
  <asset><mesh name="plate" builtin="plate" params="26 26" scale="0.0075 0.0075 0.0001"/></asset>
  <worldbody>
    <geom name="pad" type="box" pos="0 0 -0.0025" size="0.0075 0.0075 0.0025" priority="1" condim="4"
          solref="0.003 1" solimp="0.98 0.99 0.001 0.5 2"/>
    <geom name="skin" type="box" size="1e-6 0.0075 0.0075" quat="1 0 -1 0" contype="0" conaffinity="0" mass="0"/>
    <site name="surface" type="box" size="0.0075 0.0075 0.001"/>
    <site name="behind" pos="0 0 -0.0075" euler="180 0 0"/>
    <body name="body" pos="0 0 0.0031">
      <joint name="x" type="slide" axis="1 0 0" damping="0.1"/>
      <joint name="z" type="slide" axis="0 0 1" damping="0.1"/>
      <geom {shape} mass="{mass}"/>
    </body>
  </worldbody>
  <actuator><motor name="x" joint="x"/><motor name="z" joint="z"/></actuator>
  <sensor>
    <plugin name="pad" plugin="mjtactile.pad" objtype="geom" objname="pad">
      <config key="output" value="stress carried"/>
    </plugin>
    <touch name="touch" site="surface"/>
    <plugin name="grid" plugin="mujoco.sensor.touch_grid" objtype="site" objname="behind">
      <config key="size" value="13 13"/><config key="fov" value="60 60"/><config key="nchannel" value="3"/>
    </plugin>
    <tactile name="tactile" geom="skin" mesh="plate"/>
  </sensor>
</mujoco>
"""

BOX = 'type="box" size="0.004 0.003 0.003"'
BALL = 'type="sphere" size="0.008" pos="0 0 0.005"'
#: What taxels stand for along one axis [m]; the outer ones lie on the pad's rim.
WIDTHS = np.array([0.5, *[1.0] * 11, 0.5]) * mjtactile.Pad().taxels.pitch[0]

print("commanded: pressed / pushed aside [N] -> what each sensor says")
for name, shape, mass, into, aside in (
    ("box, 10 g", BOX, 0.01, 0.25, 0.0),
    ("box, 10 g", BOX, 0.01, 0.5, 0.0),
    ("box, 10 g", BOX, 0.01, 0.5, 0.1),
    ("box, 100 g", BOX, 0.1, 0.5, 0.0),
    ("ball, 10 g", BALL, 0.01, 0.5, 0.0),
):
    model = mujoco.MjModel.from_xml_string(SCENE.format(shape=shape, mass=mass))
    data = mujoco.MjData(model)
    data.ctrl[:] = aside, -into
    mujoco.mj_step(model, data, 1000)

    stress, carried = np.split(data.sensor("pad").data, [6 * 676])
    zz = stress.reshape(6, 4, 13, 13)[2]  # in each layer it must balance the force
    layers = -np.einsum("lyx,y,x->l", zz, WIDTHS, WIDTHS)
    touch = data.sensor("touch").data[0]
    grid = data.sensor("grid").data.reshape(3, -1).sum(axis=1)
    depth = data.sensor("tactile").data.reshape(3, -1)[0].sum()
    print(f"{name}: {into:.3f} / {aside:.3f}")
    print(f"  mjtactile, force its readings carry [N]   {-carried[2]:.4f} / {carried[0]:.4f}")
    print(f"  mjtactile, stress over each layer [N]     {' '.join(f'{force:.3f}' for force in layers)}")
    print(f"  MuJoCo touch [N]                          {touch:.4f} / -")
    print(f"  MuJoCo touch_grid, summed [N]             {grid[0]:.4f} / {abs(grid[1:]).max():.4f}")
    print(f"  MuJoCo <tactile>, depths summed [mm]      {depth * 1e3:.4f} / -")
