"""Contacts that recognisers were not taught: several bodies, lying rods, faces of other shapes and over edges."""

from __future__ import annotations

from dataclasses import dataclass

import mujoco
import numpy as np

from mjtactile._types import Array
from mjtactile.attach import attach_pad
from mjtactile.errors import quiet_contacts
from mjtactile.fidelity import Fidelity
from mjtactile.pad import Pad
from mjtactile.recognition import ForceRecogniser
from mjtactile.recognition.evaluation.arrays import noisy
from mjtactile.sensor import TactileSensor

#: Kinds of contacts by name in the tables.
KINDS = ("two bodies", "a lying rod", "a face over the edge", "a narrow rectangle", "a face that covers the pad")
#: Relative error from which a force counts as wrong [-].
WRONG = 0.1
#: Largest and least force of one body [N], which the shipped recognisers were trained with.
_FORCES = (0.1, 1.9)
#: Time in which bodies of 20 g come to rest under these forces [s].
_SETTLE = 0.25
_BOX, _SPHERE = mujoco.mjtGeom.mjGEOM_BOX, mujoco.mjtGeom.mjGEOM_SPHERE
_CYLINDER, _CAPSULE = mujoco.mjtGeom.mjGEOM_CYLINDER, mujoco.mjtGeom.mjGEOM_CAPSULE


@dataclass(frozen=True, kw_only=True)
class _Body:
    """A geom that is pressed straight down."""

    kind: mujoco.mjtGeom  #: of the geom
    size: tuple[float, ...]  #: as MuJoCo's [m]
    place: tuple[float, float]  #: of its middle [m]
    height: float  #: of its middle over the pad [m]
    yaw: float = 0.0  #: about the pad's normal [rad]
    lies: bool = False  #: whether its z axis lies in the pad's surface
    force: float  #: into the pad, without its weight [N]


@dataclass(frozen=True, eq=False)
class Strangers:
    """Contacts of kinds that were not taught."""

    readings: Array  #: (contacts, layers, rows, columns) [Pa]
    forces: Array  #: MuJoCo's force on the pad in each contact [N], (contacts, 3)
    kinds: np.ndarray  #: kind of each contact, (contacts,) str


def strange_contacts(pad: Pad, fidelity: Fidelity, *, count: int, seed: int) -> Strangers:
    """Contacts in MuJoCo, after the bodies have settled.

    Args:
        pad: the pad.
        fidelity: fidelity of the sensor.
        count: number of contacts of each kind; bodies that miss the pad or roll off it are left out.
        seed: seed of the contacts.
    """
    readings, forces, kinds = [], [], []
    for number, kind in enumerate(KINDS):
        rng = np.random.default_rng([seed, 98, number])
        for _ in range(count):
            felt, force = _settled(_bodies(kind, pad, rng), pad, fidelity)
            if -force[2] >= _FORCES[0] / 2 and felt.max() > 0.0:
                readings.append(felt)
                forces.append(force)
                kinds.append(kind)
    return Strangers(np.array(readings), np.array(forces), np.array(kinds))


def noticed(
    strangers: Strangers, recognise: ForceRecogniser, *, noise: float, seed: int
) -> dict[str, dict[str, float]]:
    """For each kind of contact: the number of contacts, and rates [-].

    Rates are shares of all contacts of a kind. "unfamiliar": the readings are called so. "wrong": the force is off by
    more than a tenth. "missed": it is wrong, and the readings are called familiar. "confident": it is wrong, and the
    confidence is over a half.

    Args:
        strangers: the contacts.
        recognise: the recogniser of forces.
        noise: standard deviation of white noise over the contact's largest reading [-].
        seed: seed of the noise.
    """
    found = recognise(noisy(strangers.readings, noise, seed))
    unfamiliar = np.full(len(strangers.kinds), np.nan)
    if found.familiarity is not None:
        unfamiliar = (~found.familiarity.familiar).astype(float)
    wrong = np.abs(found.magnitude / np.linalg.norm(strangers.forces, axis=1) - 1.0) > WRONG
    of_all = {
        "unfamiliar": unfamiliar,
        "wrong": wrong,
        "missed": wrong * (1.0 - unfamiliar),
        "confident": wrong & (found.confidence > 0.5),
    }
    return {
        kind: {"contacts": int((strangers.kinds == kind).sum())}
        | {name: float(np.mean(values[strangers.kinds == kind])) for name, values in of_all.items()}
        for kind in dict.fromkeys(strangers.kinds.tolist())
    }


def _bodies(kind: str, pad: Pad, rng: np.random.Generator) -> list[_Body]:
    """The bodies of a contact, of sizes like those of the punches, with their middles over the pad."""
    half = pad.size[0] / 2.0
    yaw, force = float(rng.uniform(0.0, 2.0 * np.pi)), float(rng.uniform(*_FORCES))
    x, y = (float(value) for value in rng.uniform(-0.2, 0.2, 2) * pad.size[0])
    if kind == "two bodies":
        return _apart(pad, rng)
    if kind == "a lying rod":
        radius, length = float(rng.uniform(1e-3, 4e-3)), float(rng.uniform(2e-3, 9e-3))
        geom = _CYLINDER if rng.random() < 0.5 else _CAPSULE
        rod = _Body(kind=geom, size=(radius, length), place=(x, y), height=radius, yaw=yaw, lies=True, force=force)
        return [rod]
    if kind == "a face over the edge":
        sides = rng.uniform(4e-3, 8e-3, 2)
        # Its middle is on the pad, so that it does not tip over.
        place = (float(half - rng.uniform(0.5e-3, 2.5e-3)), y)
        return [_Body(kind=_BOX, size=(*sides, 3e-3), place=place, height=3e-3, force=force)]
    if kind == "a narrow rectangle":
        sides = float(rng.uniform(2e-3, 5e-3)), float(rng.uniform(0.7e-3, 1.5e-3))
        return [_Body(kind=_BOX, size=(*sides, 2e-3), place=(x, y), height=2e-3, yaw=yaw, force=force)]
    middle = float(rng.uniform(-1e-3, 1e-3)), float(rng.uniform(-1e-3, 1e-3))
    return [_Body(kind=_BOX, size=(1.4 * half, 1.4 * half, 3e-3), place=middle, height=3e-3, force=force)]


def _apart(pad: Pad, rng: np.random.Generator) -> list[_Body]:
    """Two small bodies that do not touch one another."""
    while True:
        bodies = []
        for _ in range(2):
            x, y = (float(value) for value in rng.uniform(-0.37, 0.37, 2) * pad.size[0])
            radius, force = float(rng.uniform(1e-3, 2.6e-3)), float(rng.uniform(*_FORCES))
            geom = (_BOX, _SPHERE, _CYLINDER)[rng.integers(3)]
            size = {_BOX: (radius, radius, 2e-3), _SPHERE: (1.5 * radius,), _CYLINDER: (radius, 2e-3)}[geom]
            height = 1.5 * radius if geom == _SPHERE else 2e-3
            turn = float(rng.uniform(0.0, 2.0 * np.pi))
            bodies.append(_Body(kind=geom, size=size, place=(x, y), height=height, yaw=turn, force=force))
        # No body reaches farther than one and a half times its first size.
        if np.linalg.norm(np.subtract(bodies[0].place, bodies[1].place)) > 1.5 * (
            bodies[0].size[0] + bodies[1].size[0]
        ):
            return bodies


def _settled(bodies: list[_Body], pad: Pad, fidelity: Fidelity) -> tuple[Array, Array]:
    """Readings [Pa] and MuJoCo's force on the pad [N], (3,), after bodies have come to rest."""
    spec = mujoco.MjSpec()
    spec.option.timestep, spec.option.cone = 1e-3, mujoco.mjtCone.mjCONE_ELLIPTIC
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    spec.option.jacobian = mujoco.mjtJacobian.mjJAC_DENSE
    spec.worldbody.add_body(name="finger")
    attach_pad(spec, body="finger", name="pad", pos=(0.0, 0.0, 0.0), pad=pad, fidelity=fidelity)
    for one in bodies:
        turned = np.zeros(4)
        mujoco.mju_euler2Quat(turned, np.array([one.yaw, np.pi / 2.0 if one.lies else 0.0, 0.0]), "zyx")
        body = spec.worldbody.add_body(pos=(*one.place, one.height), quat=turned)
        body.add_freejoint()
        body.add_geom(type=one.kind, size=(*one.size, 0.0, 0.0)[:3], mass=0.02)
    model = spec.compile()
    with quiet_contacts():
        # Small bodies press hard; what recognisers make of it does not depend on the strains' size.
        data = mujoco.MjData(model)
    for k, one in enumerate(bodies):
        data.xfrc_applied[model.nbody - len(bodies) + k, 2] = -one.force
    sensor = TactileSensor(model, "pad")
    mujoco.mj_step(model, data, round(_SETTLE / model.opt.timestep))
    return sensor.read(data), sensor.wrench(data)[:3]
