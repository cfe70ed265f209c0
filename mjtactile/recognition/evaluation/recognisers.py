"""Errors of the recognisers of the package on new presses, from a seed that was not used for training.

There are two parts. The first is the protocol of Aoyagi 2008, without noise: forces on the 3 mm disc in the middle of
the pad at the angles and magnitudes of the paper's tests, and the seven punches shifted by 1.25 mm in eight directions.
The second consists of presses in MuJoCo: punches, discs and spheres at random positions, sizes and rotations under
random forces, with 1 % noise and other levels of noise. Each result is given for all layers and for the top layer.
"""

from __future__ import annotations

import math
import tempfile
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from mjtactile import recognition
from mjtactile._installed import require
from mjtactile._types import Array, Mask
from mjtactile.dataset.by_law import physics_readings
from mjtactile.dataset.files import Dataset, make_dataset, read_dataset
from mjtactile.dataset.sampling import OutlinePresses, PosePresses
from mjtactile.dataset.spec import parse_spec
from mjtactile.errors import RecognitionError
from mjtactile.fidelity import DEFAULT, as_fidelity
from mjtactile.geometry.outlines import INDENTER_NAMES
from mjtactile.influence.matrices import InfluenceMatrices
from mjtactile.pad import Pad, force_vector
from mjtactile.recognition import ForceRecogniser, ShapeRecogniser
from mjtactile.recognition.evaluation.arrays import ARRAYS, TransducerArray, noisy
from mjtactile.recognition.evaluation.strangers import noticed, strange_contacts
from mjtactile.units import GRAM_FORCE

#: The paper's test angles [deg], test forces [gf], and shift of the tested shapes [m].
ANGLES, FORCES, SHIFT = (1.0, 13.0, 18.0, 27.0), tuple(range(15, 200, 10)), 1.25e-3
#: The paper's force for shapes, and the force for directions [gf].
SHAPE_FORCE, DIRECTION_FORCE = 10.0, 100.0
#: Shapes of the paper's comparison with people.
THREE = ("circle", "triangle", "square")
#: Standard deviations of noise over a press's largest reading for the comparison of layers [-].
NOISES = (0.0, 0.003, 0.01, 0.02, 0.05)
#: The noise of all tables but that of noises [-].
NOISE = 0.01
#: Number of presses for each contact of every kind that was not taught.
_PRESSES_PER_STRANGER = 20
#: Least tilt for the comparison of directions [rad].
LEAST_TILT = math.radians(3.0)
#: Least force of a firm press [N], whose readings are well above the transducers' noise.
FIRM = 50.0 * GRAM_FORCE
_LAYERS = ("all", "top")
_TOTALS = (
    "direction_median_deg",
    "magnitude_mean_gf",
    "position_mean_mm",
    "shape_rate",
    "shape_rate_firm",
    "unfamiliar_rate",
)


@dataclass(frozen=True, kw_only=True)
class EvaluationSettings:
    """The presses of an evaluation."""

    seed: int  #: seed of presses and noise
    presses: int = 2000  #: number of presses in MuJoCo
    fidelity: str = DEFAULT  #: fidelity of the sensor, a preset by name
    law: str | None = None  #: contact law of the sensor; by default that of the fidelity


def evaluate(
    settings: EvaluationSettings, *, workers: int = 2, folder: Path | None = None, progress: bool = True
) -> dict[str, Any]:
    """Compute all results of the evaluation.

    Args:
        settings: the presses.
        workers: number of processes that make presses.
        folder: folder of other weights, with subfolders "all" and "top", or one of these; by default those of the
            package.
        progress: show a progress bar on a terminal.

    Returns:
        Plain values: "protocol", "mujoco" and "strangers" by layers ("all", "top"), "noise" and "transducers" as lists
        of rows, the settings, and a summary of the pad. Presses are on the pad that the weights are for.
    """
    require("dataset")  # before long work
    from mjtactile.influence.cache import influence_matrices

    known, seed = as_fidelity(settings.fidelity), settings.seed
    chosen = replace(known, law=known.law if settings.law is None else settings.law)
    pad, pairs = recognisers(folder)
    influence = influence_matrices(pad, fidelity=chosen, progress=progress)
    with tempfile.TemporaryDirectory() as scratch:
        spec = replace(parse_spec(_spec_values(settings, influence.fidelity.law)), pad=pad)
        make_dataset(spec, Path(scratch), workers=workers, progress=progress)
        data = read_dataset(Path(scratch))
    strangers = strange_contacts(pad, chosen, count=math.ceil(settings.presses / _PRESSES_PER_STRANGER), seed=seed)
    return {
        "seed": seed,
        "presses": len(data.readings),
        "preset": settings.fidelity,
        "law": influence.fidelity.law,
        "pad": pad.summary,
        "protocol": {layers: protocol(influence, *pair) for layers, pair in pairs.items()},
        "mujoco": {layers: random_presses(data, *pair, noise=NOISE, seed=seed) for layers, pair in pairs.items()},
        "noise": [
            {"noise": noise} | {layers: _totals(data, *pair, noise, seed) for layers, pair in pairs.items()}
            for noise in NOISES
        ],
        "transducers": [
            {"transducer": name} | {layers: _totals(data, *pair, NOISE, seed, array) for layers, pair in pairs.items()}
            for name, array in ARRAYS.items()
        ],
        "strangers": {
            layers: noticed(strangers, force, noise=NOISE, seed=seed) for layers, (force, _) in pairs.items()
        },
    }


def recognisers(folder: Path | None = None) -> tuple[Pad, dict[str, tuple[ForceRecogniser, ShapeRecogniser]]]:
    """The pad that weights are for, and the evaluated recognisers of force and shape by layers ("all", "top").

    The folder is as in `evaluate`.

    Raises:
        RecognitionError: weights are missing or damaged, those of both layers are for different pads, or they do not
            know the seven punches.
    """
    if folder is not None and folder.absolute().name in _LAYERS:
        folder = folder.absolute().parent
    pad = recognition.trained_pad(layers=_LAYERS[0], folder=folder)
    pairs = {
        layers: (
            recognition.load("force", layers=layers, folder=folder, pad=pad),
            recognition.load("shape", layers=layers, folder=folder, pad=pad),
        )
        for layers in _LAYERS
    }
    for layers, (_, shape) in pairs.items():
        if unknown := [name for name in INDENTER_NAMES if name not in shape.shapes]:
            raise RecognitionError(
                f"the weights in {folder} for layers '{layers}' know no {', '.join(unknown)}, but the evaluation "
                "presses all seven punches. Train them with these, too; of other shapes, the training scripts print "
                "what they reach on presses held out."
            )
    return pad, pairs


def _spec_values(settings: EvaluationSettings, law: str) -> dict[str, Any]:
    """The random presses of an evaluation as the values of a dataset's TOML file."""
    return {
        "seed": settings.seed,
        "presses": settings.presses,
        "backend": "mujoco",
        "fidelity": settings.fidelity,
        "law": law,
        "free": 0.25,
        "poses": 2,
        "forces": 2,
        "contact": [
            {"shapes": list(INDENTER_NAMES), "size": [0.7, 1.3], "shift": 2.5},
            {"shapes": ["disc"], "weight": 1, "shift": 2.5},
            {"shapes": ["sphere"], "weight": 1, "size": [0.5, 1.6], "shift": 2.5},
        ],
    }


def protocol(influence: InfluenceMatrices, force: ForceRecogniser, shape: ShapeRecogniser) -> dict[str, Any]:
    """Results on the test samples of Aoyagi 2008, computed without MuJoCo and without noise."""
    directions = np.array([force_vector(DIRECTION_FORCE * GRAM_FORCE, angle) for angle in ANGLES])
    found = force(_pressed(influence, "disc", (0.0, 0.0), directions))
    vectors = np.array([force_vector(f * GRAM_FORCE, angle) for angle in ANGLES for f in FORCES])
    strengths = force(_pressed(influence, "disc", (0.0, 0.0), vectors)).magnitude
    errors = np.abs(strengths - np.linalg.norm(vectors, axis=1)) / GRAM_FORCE
    down = force_vector(SHAPE_FORCE * GRAM_FORCE)[None]
    shifts = [(x * SHIFT, y * SHIFT) for x in (-1, 0, 1) for y in (-1, 0, 1) if (x, y) != (0, 0)]
    named = {
        name: [str(shape(_pressed(influence, name, shift, down)).shape[0]) for shift in shifts]
        for name in INDENTER_NAMES
    }
    three = [str(shape(_pressed(influence, name, (0.0, 0.0), down), among=THREE).shape[0]) == name for name in THREE]
    return {
        "direction_deg": float(np.degrees(angles_between(found.force, directions)).mean()),
        "direction_found_deg": [float(np.degrees(tilt)) for tilt in found.tilt],
        "magnitude_gf": float(errors.mean()),
        "magnitude_deviation_gf": float(errors.std()),
        "shapes_right": sum(answer == name for name, answers in named.items() for answer in answers),
        "shapes_asked": sum(len(answers) for answers in named.values()),
        "three_rate": dict(zip(THREE, map(float, three), strict=True)),
    }


def random_presses(
    data: Dataset,
    force: ForceRecogniser,
    shape: ShapeRecogniser,
    *,
    noise: float,
    seed: int,
    array: TransducerArray | None = None,
) -> dict[str, Any]:
    """Results on random presses with noise, in total and for each shape.

    Args:
        data: the presses.
        force: the recogniser of forces.
        shape: the recogniser of shapes.
        noise: standard deviation of white noise over the press's largest reading [-].
        seed: seed of the noise and of the transducers.
        array: transducers that read the presses; None: none.
    """
    readings = noisy(data.readings, noise, seed)
    if array is not None:
        readings = array.reported(readings, seed)
    names = data.labels["shape"]
    truth = data.forces
    found = force(readings)
    magnitude = np.linalg.norm(truth, axis=1)
    angle = np.degrees(angles_between(found.force, truth))
    tilted = np.arccos(-truth[:, 2] / magnitude) > LEAST_TILT
    strength = np.abs(found.magnitude - magnitude) / GRAM_FORCE
    where = np.linalg.norm(found.position - data.positions, axis=1) * 1e3
    punches = np.isin(names, INDENTER_NAMES)
    right = shape(readings).shape == names
    known = found.familiarity
    unfamiliar = np.full(len(names), math.nan) if known is None else (~known.familiar).astype(float)
    three = np.isin(names, THREE)
    right_of_three = np.zeros(len(names), dtype=bool)
    if three.any():
        right_of_three[three] = shape(readings[three], among=THREE).shape == names[three]

    def errors(of: Mask) -> dict[str, float]:
        return {
            "direction_median_deg": _median(angle[tilted & of]),
            "magnitude_mean_gf": _mean(strength[of]),
            "position_mean_mm": _mean(where[of]),
            "unfamiliar_rate": _mean(unfamiliar[of]),
        }

    return {
        **errors(np.ones(len(names), dtype=bool)),
        "direction_mean_deg": _mean(angle[tilted]),
        "magnitude_of_200gf": _mean(strength) / 200.0,
        "shape_rate": _mean(right[punches]),
        "shape_rate_firm": _mean(right[punches & (magnitude >= FIRM)]),
        "shapes_asked": int(punches.sum()),
        "three_rate": {name: _mean(right_of_three[names == name]) for name in THREE},
        "by_shape": {
            str(name): {"presses": int((names == name).sum()), **errors(names == name)}
            | ({"rate": _mean(right[names == name])} if name in INDENTER_NAMES else {})
            for name in sorted(set(names.tolist()))
        },
    }


def angles_between(found: Array, truth: Array) -> Array:
    """Angles between vectors (n, 3) [rad], (n,), accurate also for small angles."""
    across = np.linalg.norm(np.cross(found, truth), axis=-1)
    return np.arctan2(across, np.einsum("...i,...i->...", found, truth))


def _totals(
    data: Dataset,
    force: ForceRecogniser,
    shape: ShapeRecogniser,
    noise: float,
    seed: int,
    array: TransducerArray | None = None,
) -> dict[str, float]:
    figures = random_presses(data, force, shape, noise=noise, seed=seed, array=array)
    return {figure: figures[figure] for figure in _TOTALS}


def _pressed(influence: InfluenceMatrices, shape: str, shift: tuple[float, float], forces: Array) -> Array:
    """Readings (forces, layers, rows, columns) [Pa] of a shape under forces (forces, 3) [N]."""
    magnitudes = np.linalg.norm(forces, axis=1)
    pose = PosePresses(shift=shift, rotation=0.0, directions=forces / magnitudes[:, None], magnitudes=magnitudes)
    contact = OutlinePresses(
        first=0,
        shape=shape,
        size=1.0,
        preset="",
        law=influence.fidelity.law,
        tangential="proportional",
        free=False,
        poses=(pose,),
    )
    return physics_readings(influence, contact)[0]


def _mean(values: Array) -> float:
    return float(np.mean(values)) if len(values) else math.nan


def _median(values: Array) -> float:
    return float(np.median(values)) if len(values) else math.nan
