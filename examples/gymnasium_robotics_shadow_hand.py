"""gymnasium-robotics: the Shadow hand of `HandManipulateEgg` with a pad on each of its five fingertips."""

import tempfile
from pathlib import Path

import mujoco
import numpy as np
from gymnasium_robotics.envs.shadow_dexterous_hand.manipulate_egg import MujocoHandEggEnv

import mjtactile

#: By pad: its body, the middle of its surface there [m], and its turn. Fingers' palms look to -y, the thumb's to -x.
FINGERTIPS = {
    **{name: (f"robot0:{name}distal", (0, -8.5e-3, 17.5e-3), (1, 1, 0, 0)) for name in ("ff", "mf", "rf", "lf")},
    "th": ("robot0:thdistal", (-10.7e-3, 0, 19.5e-3), (1, 0, -1, 0)),
}


class TouchingHand(MujocoHandEggEnv):
    """The environment as it is, its model opened anew with pads on it."""

    def _initialize_simulation(self) -> None:
        spec = mujoco.MjSpec.from_file(self.fullpath)
        for name, (body, pos, quat) in FINGERTIPS.items():
            mjtactile.attach_pad(spec, body=body, name=name, pos=pos, quat=quat, fidelity="fast")
        folder = Path(self.fullpath).parent
        spec.meshdir, spec.texturedir = (str((folder / path).resolve()) for path in (spec.meshdir, spec.texturedir))
        spec.compile()
        with tempfile.TemporaryDirectory() as temporary:
            self.fullpath = str(Path(temporary) / "hand.xml")
            Path(self.fullpath).write_text(spec.to_xml())
            super()._initialize_simulation()


env = TouchingHand(target_position="ignore", target_rotation="xyz")
env.reset(seed=2)
model, data = env.model, env.data
mjtactile.preview_pad(model, "ff", "gymnasium_robotics_shadow_hand.png", data=data)

action = np.zeros(20)  # of the range of each joint, from -1 to 1
action[[3, 4, 6, 7, 9, 10, 13, 14, 16]] = 0.2  # fingers and thumb close a little
action[19] = -0.2
for _ in range(40):
    env.step(action)

for name in FINGERTIPS:
    readings = data.sensor(name).data.reshape(4, 13, 13)
    force = abs(mjtactile.TactileSensor(model, name).wrench(data)[2])
    print(f"{name}: force {force:.2f} N, highest reading {readings.max() / 1e3:.0f} kPa")
print("what touches a pad's rim is in its force, not in its readings")
