"""Shapes of pads: outer surfaces, surfaces fitted to meshes, and taxels at free positions."""
