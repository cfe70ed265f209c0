"""Models of real hands with pads on fingertips, phalanges and palms, attached in one call.

    mjtactile.hands.attach_hand(spec, "shadow", fidelity="fast")

Each hand is a TOML file in `tables/` with the shapes of its pads and their bodies and poses. docs/hands.md lists them.
"""

from mjtactile.hands.attach_hand import attach_hand
from mjtactile.hands.catalogue import HANDS, Hand, HandPad, hand
from mjtactile.hands.model_files import check_model

__all__ = ["HANDS", "Hand", "HandPad", "attach_hand", "check_model", "hand"]
