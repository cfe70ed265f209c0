"""An experiment that costs nothing, in a module that worker processes find."""

import numpy as np

from mjtactile.experiments.grasp.trials import Experiment

CALLS = []


def trial(settings, condition, number):
    CALLS.append((condition, number))
    return {"value": float(np.random.default_rng([settings.seed, number]).random()), "condition": condition}


COUNTING = Experiment(
    name="counting",
    conditions=("one", "other"),
    trial=trial,
    report=lambda results: results,
    recognisers=lambda weights: None,
)
