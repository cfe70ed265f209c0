"""Touch inside a control loop: `mjtactile loop` presses with commanded forces and sorts punches it has only felt.

A gantry of springy arms holds seven punches, one each, in unknown order and unknown poses; the pad lies in the middle.
The controller knows where racks and bins are and what was recognised: no wrench, no pose, no shape from MuJoCo.
"""
