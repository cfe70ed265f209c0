"""Grasping with touch: scenes with a hand and an object, controllers, and experiments that evaluate them.

Controllers use only recognition from the pads' readings and the robot's own proprioception. Judges, and a baseline for
comparison, read MuJoCo's state.
"""
