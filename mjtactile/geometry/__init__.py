"""Shapes and their lower surfaces over a pad: punches, polygons, solids, primitives, triangle meshes. No MuJoCo."""
