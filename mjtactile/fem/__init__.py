"""Finite elements of a layered pad: mesh, elements, symmetry, dissection, stress at points, taxel quadrature."""
