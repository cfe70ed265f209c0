"""Reproduction of the study of Aoyagi 2008: its networks, samples and tables, compared with our results.

`mjtactile reproduce` runs it; docs/study.md has its results. Nothing is tuned on the unknown samples: they are used
only once, to test the trained networks.
"""

from mjtactile._installed import require

require("torch")
