"""MuJoCo: contact wrenches, geoms that are pads, models and scenes as MJCF, pictures."""
