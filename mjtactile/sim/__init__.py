"""MuJoCo's side: contact wrenches, geoms as shapes, footprints of bodies, models and scenes as text, pictures."""
