"""Finite elements of pads under a curved surface: swept elements, their equations and the stress in them."""
