"""mujoco.rollout: 64 simulations at once on all processors, each pressed with another force, and all their readings."""

from pathlib import Path

import mujoco
import numpy as np
from mujoco import rollout

import mjtactile

spec = mujoco.MjSpec.from_file(str(Path(__file__).with_name("finger.xml")))
spec.body("weight").add_site(name="top")
spec.add_actuator(name="press", trntype=mujoco.mjtTrn.mjTRN_SITE, target="top", gear=[0, 0, -1, 0, 0, 0]).set_to_motor()
model = spec.compile()

simulations, steps = 64, 200
start = np.zeros(mujoco.mj_stateSize(model, mujoco.mjtState.mjSTATE_FULLPHYSICS))
mujoco.mj_getState(model, mujoco.MjData(model), start, mujoco.mjtState.mjSTATE_FULLPHYSICS)
forces = np.linspace(0, 1, simulations)  # newtons
control = np.broadcast_to(forces[:, None, None], (simulations, steps, 1))

threads = [mujoco.MjData(model) for _ in range(2)]
_, sensordata = rollout.rollout(model, threads, start[None], control)

readings = sensordata[..., :676].reshape(simulations, steps, *mjtactile.Pad().reading_shape)
wrenches = sensordata[..., 676:]
print(f"readings: shape {readings.shape}")
for k in (0, 21, 63):
    felt, highest = -wrenches[k, -1, 2], readings[k, -1].max() / 1e3
    print(f"pressed with {forces[k] + 0.4905:.3f} N: the pad feels {felt:.3f} N, at most {highest:.1f} kPa")

data = mujoco.MjData(model)  # the last one again, alone
data.ctrl[:] = forces[-1]
mujoco.mj_step(model, data, steps)
print(f"one alone differs by {np.abs(data.sensordata - sensordata[-1, -1]).max():.0e}")
