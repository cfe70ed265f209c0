"""The force networks: one for the direction, and one for the magnitude given the direction (tables 2 and 3)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from mjtactile._types import Array
from mjtactile.experiments.study.networks import NetworkDesign, Networks, Training, train
from mjtactile.experiments.study.presses import oblique_readings, unit_vectors
from mjtactile.experiments.study.protocol import (
    DIRECTION_HIDDEN,
    DIRECTION_ITERATIONS,
    FULL_FORCE,
    MAGNITUDE_HIDDEN,
    TRAINING_ANGLES,
    TRAINING_FORCES,
    UNKNOWN_ANGLES,
    UNKNOWN_FORCES,
)
from mjtactile.influence.matrices import InfluenceMatrices
from mjtactile.units import GRAM_FORCE

#: Scalings of the maximum readings for the magnitude network: by the largest reading of their layer among the training
#: samples, or by the largest of all layers.
SCALINGS = ("each layer", "all layers")


def force_study(
    influence: InfluenceMatrices,
    *,
    law: str,
    layers: int,
    training: Training,
    scaling: str = "each layer",
    **of_network: Any,
) -> dict[str, Any]:
    """Train both networks on the paper's training samples and test them once on its test samples.

    The magnitude network is trained with the true direction and tested with the direction from the direction network
    with the least training error. As in the paper, the magnitude network with the least training error is reported.

    Args:
        influence: influence matrices of the paper's pad.
        law: contact law of the readings.
        layers: number of sensing layers, 1 or 4.
        training: parameters for the magnitude network; the direction network is trained for fewer iterations.
        scaling: scaling of the maximum readings, one of `SCALINGS`.
        of_network: choices of `NetworkDesign`. The paper does not specify them, nor the scaling; the defaults were
            chosen with the training samples alone.

    Returns:
        {"direction": ..., "magnitude": ...}, angles in degrees and forces in gram-force; see `_direction_result` and
        `_magnitude_result`.
    """
    known = oblique_readings(influence, law, TRAINING_ANGLES)[:, :layers]
    unknown = oblique_readings(influence, law, UNKNOWN_ANGLES)[:, :layers]
    design = NetworkDesign(hidden=DIRECTION_HIDDEN[layers], **of_network)
    shorter = replace(training, iterations=min(DIRECTION_ITERATIONS, training.iterations))
    directions = train(design, over_maximum(known), unit_vectors(TRAINING_ANGLES), shorter)
    peaks = _peaks(known, TRAINING_FORCES)
    scale = peaks.max(axis=0) if scaling == "each layer" else np.full(layers, peaks.max())
    inputs = _magnitude_inputs(unit_vectors(TRAINING_ANGLES), TRAINING_FORCES, peaks / scale)
    targets = np.tile(TRAINING_FORCES, len(TRAINING_ANGLES))[:, None] / FULL_FORCE
    magnitudes = train(replace(design, hidden=MAGNITUDE_HIDDEN[layers]), inputs, targets, training)
    recognised = directions(over_maximum(unknown))
    return {
        "direction": _direction_result(directions, directions(over_maximum(known)), recognised),
        "magnitude": _magnitude_result(
            magnitudes, recognised[int(directions.error.argmin())], _peaks(unknown, UNKNOWN_FORCES) / scale
        ),
    }


def over_maximum(readings: Array) -> Array:
    """Readings divided by the largest of their sample, (samples, taxels), from 0 to 1."""
    flat = readings.reshape(len(readings), -1)
    return flat / flat.max(axis=1, keepdims=True)


def _peaks(readings_of_one_newton: Array, forces_gf: Sequence[float]) -> Array:
    """Largest reading of each layer [Pa] for every angle and force, shape (angles x forces, layers)."""
    peaks = readings_of_one_newton.max(axis=(2, 3))
    forces = np.array(forces_gf) * GRAM_FORCE
    return (peaks[:, None] * forces[:, None]).reshape(-1, peaks.shape[1])


def _angles(vectors: Array) -> Array:
    """Angles from the normal in the x-z plane [deg]."""
    return np.degrees(np.arctan2(vectors[..., 0], vectors[..., 2]))


def _direction_result(directions: Networks, trained: Array, recognised: Array) -> dict[str, Any]:
    """For each seed: mean error over the training angles and recognised test angles [deg]; and the best seed."""
    return {
        "training_deg": (_angles(trained) - TRAINING_ANGLES).mean(axis=1).tolist(),
        "training_rms": directions.error.tolist(),
        "recognised_deg": _angles(recognised).tolist(),
        "best": int(directions.error.argmin()),
        "iterations": directions.iterations,
    }


def _magnitude_inputs(vectors: Array, forces_gf: Sequence[float], peaks: Array) -> Array:
    """Inputs of the magnitude network (angles x forces, 3 + layers): a unit vector for each angle, scaled peaks."""
    return np.hstack([np.repeat(vectors, len(forces_gf), axis=0), peaks])


def _errors(magnitudes: Networks, vectors: Array, peaks: Array) -> Array:
    """Absolute errors on the test samples [gf], (seeds, samples)."""
    wanted = np.tile(UNKNOWN_FORCES, len(UNKNOWN_ANGLES))
    return np.abs(magnitudes(_magnitude_inputs(vectors, UNKNOWN_FORCES, peaks))[..., 0] * FULL_FORCE - wanted)


def _magnitude_result(magnitudes: Networks, recognised: Array, peaks: Array) -> dict[str, Any]:
    """For each seed: errors on the test samples with recognised directions (angles, 3), and with the true ones."""
    errors = _errors(magnitudes, recognised / np.linalg.norm(recognised, axis=1, keepdims=True), peaks)
    return {
        "unknown_gf": errors.mean(axis=1).tolist(),
        "deviation_gf": errors.std(axis=1).tolist(),
        "worst_gf": errors.max(axis=1).tolist(),
        "best": int(magnitudes.error.argmin()),
        "training_gf": (magnitudes.error * FULL_FORCE).tolist(),
        "with_true_direction_gf": _errors(magnitudes, unit_vectors(UNKNOWN_ANGLES), peaks).mean(axis=1).tolist(),
        "iterations": magnitudes.iterations,
    }
