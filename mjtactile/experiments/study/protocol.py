"""The paper's protocol: samples, networks, and the numbers of its tables 2 to 6.

Source: S. Aoyagi, Recognition of Contact State of Four Layers Arrayed Type Tactile Sensor by Using Neural Networks, in
"Sensors: Focus on Tactile, Force and Stress Sensors", I-Tech 2008, chapter 16. Angles are degrees from the normal in
the x-z plane, forces gram-force.
"""

from __future__ import annotations

import math
from typing import Any

from mjtactile.units import GRAM_FORCE

#: Angles [deg] and forces [gf] of the training samples and of the unknown samples, which are the test samples.
TRAINING_ANGLES = tuple(range(0, 36, 5))
UNKNOWN_ANGLES = (1, 13, 18, 27)
TRAINING_FORCES = tuple(range(10, 201, 10))
UNKNOWN_FORCES = tuple(range(15, 196, 10))
#: Largest force [gf]; targets of the magnitude network are forces divided by it.
FULL_FORCE = 200.0
#: Radius of the obliquely cut cylinder that applies the forces [m], and the force on the shapes [N].
DISC_RADIUS = 3e-3
SHAPE_FORCE = 10.0 * GRAM_FORCE

#: Shift of the test punches [m], and its directions, which the paper does not specify.
SHIFT = 1.25e-3
DIRECTIONS = ("+x", "+x+y", "+y", "-x+y", "-x", "-x-y", "-y", "+x-y")
#: Punches that a blindfolded person had to distinguish, and how often each was presented, in random order.
PRESENTED = ("circle", "triangle", "square")
PRESENTATIONS = 30

#: Sensing layers of the two sensors: the one-layer sensor is the 1 mm layer alone.
LAYERS = (1, 4)
#: Hidden units of the networks by sensing layers; inputs and outputs follow from the data.
DIRECTION_HIDDEN = {1: (20,), 4: (20,)}
MAGNITUDE_HIDDEN = {1: (169,), 4: (169,)}
SHAPE_HIDDEN = {1: (169, 13), 4: (676, 20)}
#: Largest number of training iterations: the paper's for the magnitude network, assumed for the others.
MAGNITUDE_ITERATIONS = 100_000
DIRECTION_ITERATIONS = 5_000
SHAPE_ITERATIONS = 400
#: Training iterations of the magnitude network for the comparison of variants.
VARIANT_ITERATIONS = 2_000
#: Initialisations of each network.
INITIALISATIONS = 10

#: Table 2: mean training error, and the angle recognised for each unknown one [deg], by sensing layers.
PAPER_DIRECTION: dict[int, dict[str, Any]] = {
    1: {"training": -0.04, "unknown": (0.8, 12.8, 18.0, 26.8)},
    4: {"training": 0.04, "unknown": (0.9, 13.0, 18.0, 27.2)},
}
#: Table 3: mean training error, mean absolute error of the unknown samples, its standard deviation [gf].
PAPER_MAGNITUDE: dict[int, dict[str, float]] = {
    1: {"training": 0.003, "unknown": 0.53, "deviation": 0.17},
    4: {"training": 0.001, "unknown": 0.23, "deviation": 0.03},
}
#: Tables 4 and 5: outputs for the shifted punches. Rows are true shapes and columns recognised ones, in the order of
#: INDENTER_NAMES. For table 5, the paper gives the diagonal and says that every other entry is at most 0.01.
PAPER_ONE_LAYER_SHAPES = (
    (0.62, 0, 0.99, 0, 0, 0, 0),
    (0.89, 0, 0, 0, 0, 0, 0),
    (0, 0, 1, 0, 0, 0, 0),
    (0.62, 0, 0.38, 0.13, 0, 0, 0),
    (0, 0, 0, 0, 0.97, 0, 0),
    (0, 0, 0, 0.16, 0, 0.98, 0),
    (0, 0, 0, 0, 0, 0, 1),
)
PAPER_FOUR_LAYER_DIAGONAL = (0.95, 0.99, 1.0, 0.81, 1.0, 0.99, 1.0)
PAPER_SHAPES_RIGHT = {1: 4, 4: 7}
#: Table 6: recognition rates of circle, triangle, square [%].
PAPER_RATES = {"people": (100.0, 100.0, 100.0), "network": (96.8, 100.0, 98.2)}


def shift_towards(direction: str) -> tuple[float, float]:
    """The shift (x, y) [m] by `SHIFT` towards one of `DIRECTIONS`."""
    turn = math.radians(45.0 * DIRECTIONS.index(direction))
    return SHIFT * math.cos(turn), SHIFT * math.sin(turn)
