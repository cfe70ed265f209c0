"""The units of the study's work; the result of each is stored on disk when it is finished."""

from __future__ import annotations

import hashlib
import json
import sys
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from mjtactile._files import write_atomically
from mjtactile.experiments.study.protocol import (
    INITIALISATIONS,
    LAYERS,
    MAGNITUDE_ITERATIONS,
    SHAPE_ITERATIONS,
    VARIANT_ITERATIONS,
)
from mjtactile.influence.cache import cache_directory, influence_matrices
from mjtactile.influence.matrices import InfluenceMatrices

#: Increment it when a change invalidates stored results.
STUDY_VERSION = 2
#: Contact laws that give readings of their own; "foundation" presses a flat punch just as "uniform" does.
STUDIED_LAWS = ("uniform", "elastic")
#: Single changes of the studies' options, to find reasons for differences from the paper.
FORCE_VARIANTS: dict[str, dict[str, Any]] = {
    "as studied": {},
    "maxima over the largest of all layers": {"scaling": "all layers"},
    "initial weights within 0.5": {"initial": "half"},
    "initial weights normal, 0.05": {"initial": "small"},
    "first step 0.1": {"first_step": 0.1},
    "smallest step 1e-6": {"smallest_step": 1e-6},
}
SHAPE_VARIANTS: dict[str, dict[str, Any]] = {
    "as studied": {},
    "readings in kilopascals": {"scaling": "kilopascal"},
    "each layer over its maximum": {"scaling": "layer maximum"},
    "each taxel standardised": {"scaling": "standard"},
    "initial weights within 0.5": {"initial": "half"},
    "initial weights normal, 0.05": {"initial": "small"},
    "hidden units tanh": {"activation": "tanh"},
    "first step 0.1": {"first_step": 0.1},
    "learning stopped at a training error of 0.1": {"tolerance": 0.1},
    "learning stopped at a training error of 0.2": {"tolerance": 0.2},
}


@dataclass(frozen=True, kw_only=True)
class StudySettings:
    """Extent of the study."""

    seeds: int = INITIALISATIONS  #: initialisations of every network
    fidelity: str = "precise"  #: fidelity of the readings; the paper took its own from a fine finite element model
    magnitude_iterations: int = MAGNITUDE_ITERATIONS  #: training iterations of the magnitude networks
    variant_iterations: int = VARIANT_ITERATIONS  #: the same for the variants
    shape_iterations: int = SHAPE_ITERATIONS  #: training iterations of the shape networks
    variants: bool = True  #: whether to run the variants


#: A minimal study, to test that everything runs.
QUICK = StudySettings(
    seeds=2, fidelity="fast", magnitude_iterations=300, variant_iterations=100, shape_iterations=50, variants=False
)


@dataclass(frozen=True, kw_only=True)
class Unit:
    """One training and test of networks of one kind, for one contact law and number of layers."""

    study: str  #: "force" or "shape"
    law: str  #: contact law of the readings
    layers: int  #: number of sensing layers, 1 or 4
    variant: str  #: key of `FORCE_VARIANTS` or `SHAPE_VARIANTS`
    iterations: int  #: number of training iterations
    seeds: int  #: number of initialisations
    fidelity: str  #: fidelity of the readings

    @property
    def options(self) -> dict[str, Any]:
        """Options that the variant changes."""
        return (FORCE_VARIANTS if self.study == "force" else SHAPE_VARIANTS)[self.variant]

    @property
    def cost(self) -> float:
        """Estimated time on one core [s], for the progress bar."""
        if self.study == "force":
            return 0.15e-3 * self.seeds * self.iterations + 1.0
        return (7e-3 if self.layers == 4 else 0.3e-3) * self.seeds * self.iterations / 2 + 2.0

    def run(self) -> dict[str, Any]:
        """Train and test; results as in force.py and shape.py."""
        import torch

        from mjtactile.experiments.study.force import force_study
        from mjtactile.experiments.study.networks import Training
        from mjtactile.experiments.study.shape import TOLERANCE, shape_study

        torch.set_num_threads(1)
        influence = influence_matrices(fidelity=self.fidelity, progress=False)
        study = force_study if self.study == "force" else shape_study
        options = {"tolerance": 0.0 if self.study == "force" else TOLERANCE, **self.options}
        tolerance = options.pop("tolerance")
        training = Training(seeds=range(self.seeds), iterations=self.iterations, tolerance=tolerance)
        return study(influence, law=self.law, layers=self.layers, training=training, **options)


def units(settings: StudySettings) -> Iterator[Unit]:
    """All units of the study, longest first."""
    common: list[dict[str, Any]] = [
        {"law": law, "layers": layers, "seeds": settings.seeds, "fidelity": settings.fidelity}
        for law in STUDIED_LAWS
        for layers in LAYERS
    ]
    for one in common:
        yield Unit(study="force", variant="as studied", iterations=settings.magnitude_iterations, **one)
    for one in common:
        for variant in SHAPE_VARIANTS if settings.variants else ("as studied",):
            yield Unit(study="shape", variant=variant, iterations=settings.shape_iterations, **one)
        for variant in FORCE_VARIANTS if settings.variants else ():
            if one["layers"] == 1 and variant == "maxima over the largest of all layers":
                continue  # one layer has one maximum
            yield Unit(study="force", variant=variant, iterations=settings.variant_iterations, **one)


def kept_path(unit: Unit, influence: InfluenceMatrices) -> Path:
    """Path of a unit's stored result; the name depends on everything that determines the result."""
    import torch

    depends_on = {
        "version": STUDY_VERSION,
        "unit": asdict(unit),
        "options": unit.options,
        "pad": influence.pad.fingerprint,
        "fidelity": repr(influence.fidelity),
        "torch": torch.__version__,
        "python": sys.version_info[:2],
    }
    name = hashlib.sha256(json.dumps(depends_on, sort_keys=True).encode()).hexdigest()[:20]
    return cache_directory() / "study" / f"{name}.json"


def kept(path: Path) -> dict[str, Any] | None:
    """The stored result in a file; None if the file does not exist or cannot be read."""
    try:
        return json.loads(path.read_text())
    except (OSError, ValueError):
        return None


def keep(path: Path, result: dict[str, Any]) -> None:
    """Write a result to a file, completely or not at all."""
    path.parent.mkdir(parents=True, exist_ok=True)
    write_atomically(path, lambda file: file.write(json.dumps(result).encode()))
