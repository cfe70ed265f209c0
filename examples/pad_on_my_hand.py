"""Put a pad on a finger of a model of your own, see where it sits, and press it on a ball."""

import mujoco
import numpy as np

import mjtactile

MY_HAND = """
<mujoco>
  <option integrator="implicitfast" cone="elliptic"/>
  <worldbody>
    <light pos="0 -0.2 0.4"/>
    <body name="finger" pos="0 0 0.1">
      <joint name="bend" type="hinge" axis="1 0 0" pos="0 0 0.04" damping="0.01"/>
      <geom type="capsule" size="0.008 0.03" rgba="0.35 0.37 0.4 1"/>
    </body>
    <geom name="ball" type="sphere" size="0.008" pos="0 -0.026 0.085" rgba="0.3 0.6 0.9 1"/>
  </worldbody>
  <actuator><motor name="bend" joint="bend"/></actuator>
</mujoco>
"""

spec = mujoco.MjSpec.from_string(MY_HAND)  # or MjSpec.from_file("my_hand.xml")
# The finger touches with its side towards -y. Turned by 90 degrees about x, the pad's z axis looks there.
mjtactile.attach_pad(spec, body="finger", name="tip", pos=(0, -0.0095, -0.015), quat=(1, 1, 0, 0))
model = spec.compile()

mjtactile.preview_pad(model, "tip", "pad_on_my_hand.png")

data = mujoco.MjData(model)
data.actuator("bend").ctrl = -0.03  # newton metres
mujoco.mj_step(model, data, 500)

sensor = mjtactile.TactileSensor(model, "tip")
readings = sensor.read(data)
layer, row, column = np.unravel_index(readings.argmax(), readings.shape)
print(f"force into the pad: {-sensor.wrench(data)[2]:.3f} N")
print(f"highest reading: {readings.max() / 1e3:.1f} kPa in layer {layer}, row {row}, column {column}")
