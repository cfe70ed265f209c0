"""The shape networks: trained on seven centred punches, tested on the shifted punches (tables 4 to 6)."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from mjtactile._types import Array
from mjtactile.experiments.study.networks import NetworkDesign, Training, train
from mjtactile.experiments.study.presses import punch_reading, punch_readings
from mjtactile.experiments.study.protocol import (
    DIRECTIONS,
    PRESENTATIONS,
    PRESENTED,
    SHAPE_HIDDEN,
    SHIFT,
    shift_towards,
)
from mjtactile.geometry.outlines import INDENTER_NAMES
from mjtactile.influence.matrices import InfluenceMatrices

#: Scalings of readings: divided by the sample's largest reading, in kilopascals, each layer divided by its own largest
#: reading, or each taxel standardised by its mean and standard deviation among the training samples.
SCALINGS = ("maximum", "kilopascal", "layer maximum", "standard")
#: Root mean square error of all outputs at which the training of a shape network stops.
TOLERANCE = 1e-3
#: Seed of the order and places of presentations.
_PRESENTATION_SEED = 2008


def shape_study(
    influence: InfluenceMatrices,
    *,
    law: str,
    layers: int,
    training: Training,
    scaling: str = "maximum",
    **of_network: Any,
) -> dict[str, Any]:
    """Train the shape network on the seven centred punches and test it once on the shifted ones.

    Args:
        influence: influence matrices of the paper's pad.
        law: contact law of the readings.
        layers: number of sensing layers, 1 or 4.
        training: parameters of the training; its tolerance is `TOLERANCE`, or that of a variant.
        scaling: scaling of the readings, one of `SCALINGS`.
        of_network: choices of `NetworkDesign`. The paper does not specify them, nor scaling and tolerance; the defaults
            were chosen with the training samples alone.

    Returns:
        {"right": number of recognised punches, of 7, by direction and seed; "outputs": outputs by direction, (7, 7),
        mean over seeds; "trained": number of recognised training punches, of 7, by seed; "training_rms": training error
        by seed; "iterations": number of iterations; "presented": see `_presented`}.
    """
    centred = punch_readings(influence, law)[:, :layers]
    scaled = _scaler(centred, scaling)
    design = NetworkDesign(hidden=SHAPE_HIDDEN[layers], output="sigmoid", **of_network)
    networks = train(design, scaled(centred), np.eye(len(INDENTER_NAMES)), training)

    def see(readings: Array) -> Array:
        return networks(scaled(readings[:, :layers]))

    answers = {name: see(punch_readings(influence, law, shift_towards(name))) for name in DIRECTIONS}
    return {
        "right": {name: _count_right(each).tolist() for name, each in answers.items()},
        "outputs": {name: each.mean(axis=0).tolist() for name, each in answers.items()},
        "trained": _count_right(networks(scaled(centred))).tolist(),
        "training_rms": networks.error.tolist(),
        "iterations": networks.iterations,
        "presented": _presented(influence, law, see),
    }


def _count_right(answers: Array) -> Array:
    """Number of punches that the network of each seed recognises, (seeds,); answers are (seeds, punches, outputs)."""
    return (answers.argmax(axis=2) == np.arange(answers.shape[1])).sum(axis=1)


def _presented(influence: InfluenceMatrices, law: str, see: Callable[[Array], Array]) -> dict[str, Any]:
    """Test with circle, triangle and square in random order, ten times each, at random positions.

    The result is {name: {"rate": by seed [-], "output": mean output of the true shape by seed}}.

    The paper does not say how the shapes were presented to its network. Here their centres are uniformly distributed
    over the disc of radius 1.25 mm about the pad's middle, as if the punches were put down by hand.
    """
    drawn = np.random.default_rng(_PRESENTATION_SEED)
    order = drawn.permutation(np.repeat(np.arange(len(PRESENTED)), PRESENTATIONS // len(PRESENTED)))
    radius, turn = SHIFT * np.sqrt(drawn.random(len(order))), 2.0 * np.pi * drawn.random(len(order))
    places = np.column_stack([radius * np.cos(turn), radius * np.sin(turn)])
    readings = np.stack(
        [
            punch_reading(influence, law, PRESENTED[k], (float(x), float(y)))
            for k, (x, y) in zip(order, places, strict=True)
        ]
    )
    answers = see(readings)
    result = {}
    for k, name in enumerate(PRESENTED):
        true = INDENTER_NAMES.index(name)
        own = answers[:, order == k]
        result[name] = {
            "rate": (own.argmax(axis=2) == true).mean(axis=1).tolist(),
            "output": own[:, :, true].mean(axis=1).tolist(),
        }
    return result


def _scaler(training: Array, scaling: str) -> Callable[[Array], Array]:
    """The function from readings (samples, layers, rows, columns) to inputs (samples, taxels); fitted to `training`."""
    match scaling:
        case "maximum":
            return lambda readings: _flat(readings / readings.max(axis=(1, 2, 3), keepdims=True))
        case "kilopascal":
            return lambda readings: _flat(readings * 1e-3)
        case "layer maximum":
            return lambda readings: _flat(readings / readings.max(axis=(2, 3), keepdims=True))
        case "standard":
            mean, deviation = training.mean(axis=0), training.std(axis=0)
            return lambda readings: _flat((readings - mean) / deviation)
        case other:
            raise ValueError(f"scaling {other!r} does not exist. Available: {', '.join(SCALINGS)}.")


def _flat(readings: Array) -> Array:
    return readings.reshape(len(readings), -1)
