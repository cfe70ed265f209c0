"""MuJoCo: contact wrenches, geoms as shapes, footprints of bodies, models and scenes as MJCF, rendering."""
