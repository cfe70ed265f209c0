"""Reproduction of the study of Aoyagi 2008: its networks, samples and tables, compared with our results.

`mjtactile reproduce` runs it; docs/study.md says what came out. Nothing here is tuned on the unknown samples: they are
looked at once, by networks that are finished.
"""

from mjtactile._installed import require

require("torch")
