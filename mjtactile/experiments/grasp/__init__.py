"""Grasping with touch: worlds with a hand and an object, controllers, and experiments that measure them.

Controllers know what was recognised of the pads' readings and what a robot knows of itself, and nothing else. Judges
and the baseline that is allowed to cheat read MuJoCo's state.
"""
