"""Touch in a control loop: `mjtactile loop` presses with commanded forces, and sorts punches by touch alone.

Seven compliant arms hold one punch each, in unknown order and unknown poses; the pad is in the middle. The controller
knows the positions of rack and bins and the results of recognition. It gets no wrench, pose or shape from MuJoCo.
"""
