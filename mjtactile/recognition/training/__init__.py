"""How recognisers are made: presses looked at, networks fitted, shapes added, examples kept. Needs torch."""

from mjtactile._installed import require

require("torch")
