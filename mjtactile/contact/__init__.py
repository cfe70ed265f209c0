"""How a rigid body presses on a pad: footprints, contact laws, and the tractions that carry a wrench."""
