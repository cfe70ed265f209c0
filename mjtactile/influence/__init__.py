"""Influence matrices of a pad, from forces on its surface to readings: built, compressed, kept on disk, applied."""
