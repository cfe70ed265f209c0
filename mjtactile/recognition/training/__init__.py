"""Training of recognisers: features of presses, fitting of networks, adding shapes, stored examples. Needs torch."""

from mjtactile._installed import require

require("torch")
