"""A round fingertip in MuJoCo: a curved pad on a finger that rolls over a ball."""

import mujoco
import numpy as np

import mjtactile

MY_FINGER = """
<mujoco>
  <option timestep="0.001" integrator="implicitfast" cone="elliptic" gravity="0 0 0"/>
  <worldbody>
    <light pos="0 -0.2 0.4"/>
    <body name="finger" pos="0 0 0.03">
      <joint name="lower" type="slide" axis="0 0 -1" damping="2"/>
      <joint name="roll" type="hinge" axis="0 1 0" pos="0 0 -0.01" damping="0.02"/>
      <geom type="capsule" size="0.0075 0.012" pos="0 0 0.004" rgba="0.35 0.37 0.4 1"/>
    </body>
    <geom name="ball" type="sphere" size="0.008" rgba="0.3 0.6 0.9 1"/>
  </worldbody>
  <actuator><motor name="lower" joint="lower"/><position name="roll" joint="roll" kp="0.5"/></actuator>
</mujoco>
"""

pad = mjtactile.Pad(
    size=(12e-3, 12e-3),  # seen from above [m]
    surface=mjtactile.CylinderSector(radius=9e-3),  # along the pad's y
    layers=mjtactile.Layer(thickness=2.5e-3, young=1e6, poisson=0.49),
    taxels=mjtactile.TaxelGrid(rows=9, columns=9, pitch=(1.2e-3, 1.2e-3)),
    depths=(1e-3,),
    sampling_radius=0.5e-3,
)
spec = mujoco.MjSpec.from_string(MY_FINGER)
# The finger touches with its lower end: turned by 180 degrees about x, the pad's z axis looks down.
place = {"body": "finger", "pos": (0, 0, -0.019), "quat": (0, 1, 0, 0)}
mjtactile.attach_pad(spec, name="tip", **place, pad=pad, fidelity="fast", output="von_mises wrench")
model = spec.compile()
mjtactile.preview_pad(model, "tip", "curved_pad_in_mujoco.png")

data = mujoco.MjData(model)
data.actuator("lower").ctrl = 0.15  # newtons
for angle in (0.0, 10.0, 20.0):
    data.actuator("roll").ctrl = np.radians(angle)
    mujoco.mj_step(model, data, 500)
    readings, wrench = np.split(data.sensor("tip").data, [81])
    row, column = np.unravel_index(readings.argmax(), (9, 9))
    rolled, force = abs(np.degrees(data.joint("roll").qpos[0])), np.linalg.norm(wrench[:3])
    print(
        f"rolled by {rolled:.0f} degrees: {force:.3f} N, highest reading {readings.max() / 1e3:.1f} kPa at "
        f"x = {pad.grid.x[column] * 1e3:.1f} mm"
    )
