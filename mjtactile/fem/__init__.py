"""Finite elements of a layered sheet: mesh, stiffness, symmetry, elimination, stress at points, taxel quadrature."""
