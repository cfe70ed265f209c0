"""Influence matrices of a pad, from forces on its surface to readings: build, compress, store and apply them."""
