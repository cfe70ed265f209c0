"""Shapes, and their lower surface over a pad: punches, polygons, solids, primitives, triangle meshes. No MuJoCo."""
