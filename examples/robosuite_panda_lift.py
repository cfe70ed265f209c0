"""robosuite: the Panda lifts the cube of `Lift`, with a pad on each of its two fingers."""

import mujoco
import numpy as np
import robosuite

import mjtactile


def with_pads(xml: str) -> str:
    """The scene that robosuite wrote, with a pad on the inner side of each fingertip."""
    spec = mujoco.MjSpec.from_string(xml)
    for name, finger, side in (("left", 1, 1), ("right", 2, -1)):
        mjtactile.attach_pad(
            spec,
            body=f"gripper0_right_finger_joint{finger}_tip",
            name=name,
            pos=(0, -0.01 * side, -0.015),  # the middle of the pad's surface, in the body's frame [m]
            quat=(1, side, 0, 0),  # the pad's z looks at the other finger
            contact="soft",  # the fingers cannot align themselves with what they grip
            fidelity="fast",
            output="von_mises wrench",
        )
        spec.actuator(f"gripper0_right_gripper_finger_joint{finger}").forcerange = (-5, 5)  # newtons; 20 lift more
    spec.compile()
    return spec.to_xml()


env = robosuite.make(
    "Lift", robots="Panda", has_renderer=False, has_offscreen_renderer=False, use_camera_obs=False, seed=0
)
env.set_xml_processor(with_pads)
seen = env.reset()
model, data = env.sim.model._model, env.sim.data._data  # MuJoCo's own
mjtactile.preview_pad(model, "left", "robosuite_panda_lift.png", data=data, groups=[1])

cube = seen["cube_pos"]
OPEN, CLOSE = -1, 1
for height, grip, steps in ((0.05, OPEN, 40), (0.0, OPEN, 30), (0.0, CLOSE, 20), (0.08, CLOSE, 40)):
    for _ in range(steps):
        way = np.add(cube, (0, 0, height)) - seen["robot0_eef_pos"]
        seen, *_ = env.step([*np.clip(10 * way, -1, 1), 0, 0, 0, grip])

print(f"the cube was lifted by {(seen['cube_pos'] - cube)[2] * 1e3:.0f} mm")
weight = model.body("cube_main").mass[0] * 9.81
upwards = 0.0
for name in ("left", "right"):
    readings, wrench = np.split(data.sensor(name).data, [676])
    upwards -= (data.site(f"{name}_surface").xmat.reshape(3, 3) @ wrench[:3])[2]
    print(f"{name} pad: grip {-wrench[2]:.2f} N, highest reading {readings.max() / 1e3:.0f} kPa")
print(f"weight of the cube {weight:.3f} N, carried by both pads {upwards:.3f} N")
