"""Presses by the hundred thousand: described, drawn from seeds, pressed, kept on disk in parts."""
