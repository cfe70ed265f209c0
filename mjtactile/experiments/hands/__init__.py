"""The hands of this package as MJCF: a gripper and a three-finger hand, with pads on all fingertips."""
