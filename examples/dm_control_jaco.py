"""dm_control: the Jaco hand as PyMJCF, with a pad on each of its three fingertips, closing on a ball."""

import numpy as np
from dm_control import mjcf
from dm_control.entities.manipulators import kinova

import mjtactile
from mjtactile.sim.pad_geom import contact_constants

mjcf_model = mjcf.RootElement()
mount = mjcf_model.worldbody.add("site")
mount.attach(kinova.JacoHand().mjcf_model)

# PyMJCF writes its own MJCF, so the pads are written in it: a box of the pad's size, and a sensor of the plugin.
mjcf_model.extension.add("plugin", plugin="mjtactile.pad")
plain = mjcf_model.default.add("default", dclass="pads")  # the fingers' class brings a mesh along
for name in ("1", "2", "3"):
    finger = mjcf_model.find("body", f"jaco_hand/b_finger_tip_{name}")
    surface = finger.add("body", name=f"pad_{name}", pos=(0.0171, 0.006, 0), quat=(-1, 1, 1, 1))
    pad = surface.add(
        "geom",
        name=f"pad_{name}",
        dclass=plain,
        type="box",
        size=(7.5e-3, 7.5e-3, 2.5e-3),
        pos=(0, 0, -2.5e-3),
        **contact_constants("stiff"),
    )
    sensor = mjcf_model.sensor.add(
        "plugin", name=f"touch_{name}", plugin="mjtactile.pad", objtype="geom", objname=pad.full_identifier
    )
    sensor.add("config", key="fidelity", value="fast")

mjcf_model.worldbody.add("body", name="ball", pos=(0, 0.016, 0.175)).add(
    "geom", type="sphere", size=(0.022,), mass=0.05
)
for actuator in mjcf_model.find_all("actuator"):
    actuator.forcerange = (-0.2, 0.2)  # newton metres; the hand could do five times as much

physics = mjcf.Physics.from_mjcf_model(mjcf_model)
model, data = physics.model.ptr, physics.data.ptr  # MuJoCo's own
mjtactile.preview_pad(model, "touch_1", "dm_control_jaco.png", data=data)

for _ in range(5000):
    physics.set_control([0.5] * 3)
    physics.step()

for name in ("1", "2", "3"):
    sensor = mjtactile.TactileSensor(model, f"touch_{name}")
    readings = np.reshape(physics.bind(mjcf_model.find("sensor", f"touch_{name}")).sensordata, (4, 13, 13))
    print(f"finger {name}: force {abs(sensor.wrench(data)[2]):.2f} N, highest reading {readings.max() / 1e3:.0f} kPa")
