"""Hands that people have, with pads on fingertips, phalanges and palms: tables, and one call that attaches them.

    mjtactile.hands.attach_hand(spec, "shadow", fidelity="fast")

A hand is a TOML file in `tables/`: which skin, which pads, on which bodies. docs/hands.md lists them.
"""

from mjtactile.hands.attach_hand import attach_hand
from mjtactile.hands.catalogue import HANDS, Hand, HandPad, hand
from mjtactile.hands.model_files import check_model

__all__ = ["HANDS", "Hand", "HandPad", "attach_hand", "check_model", "hand"]
