"""Our own hands as text: a gripper and a hand with pads on every fingertip."""
