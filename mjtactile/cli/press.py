"""One press from the scene to the readings, and its report as arrays and as plain numbers."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
from shapely import MultiPolygon, Polygon

from mjtactile._files import write_atomically
from mjtactile._types import Array
from mjtactile.cli.benchmarks.timing import median_time
from mjtactile.cli.options import json_text
from mjtactile.contact.options import contact_options
from mjtactile.errors import IndenterError, MjTactileError, SceneError
from mjtactile.fidelity import Fidelity, as_fidelity, fidelity_text
from mjtactile.geometry.indenter import Indenter, body_name, box, cylinder, mesh_indenter, punch, sphere
from mjtactile.geometry.outlines import INDENTER_NAMES
from mjtactile.influence.cache import influence_matrices
from mjtactile.influence.matrices import InfluenceMatrices
from mjtactile.influence.surface_load import SurfaceLoad
from mjtactile.pad import Pad
from mjtactile.pad_shape.taxels import FreeTaxels
from mjtactile.recognition import ShapeResult
from mjtactile.recognition import load as load_recogniser
from mjtactile.sensor import TactileSensor
from mjtactile.sim.press_scene import PressResult, press, press_scene
from mjtactile.units import GRAM_FORCE

#: Indenters by name besides the seven punches, at the sizes of models/xml.
OTHER_INDENTERS: dict[str, Callable[[], Indenter]] = {
    "sphere": lambda: sphere(6e-3),
    "cylinder": lambda: cylinder(3e-3, 8e-3),
    "box": lambda: box((6e-3, 4e-3, 5e-3)),
}
_TIMED_UPDATES = 15


@dataclass(frozen=True)
class Peak:
    """The highest reading of a layer."""

    layer: str  #: text with the depth of the layer
    reading: float  #: von Mises stress [Pa]
    place: tuple[float, float]  #: position (x, y) of the taxel in the pad frame [m]
    depth: float  #: depth of the taxel [m]


@dataclass(frozen=True, eq=False)
class RecognisedPress:
    """What recognisers make of the readings, which are all that they know of a press."""

    force: Array  #: force on the pad [N], pad frame, shape (3,)
    shape: ShapeResult | None  #: shape and pose; None for a face that covers the pad
    familiar: bool  #: whether the readings look like what the recognisers were taught; if not, the rest is likely wrong

    def as_dict(self) -> dict[str, Any]:
        """The findings as plain numbers, in SI units; None where a shape has no size or no rotation."""
        found: dict[str, Any] = {"familiar": self.familiar, "force_N": self.force.tolist()}
        if self.shape is None:
            return {**found, "shape": "a face that covers the pad"}
        size, rotation = (None if np.isnan(one) else float(one) for one in (self.shape.size, self.shape.rotation))
        return {
            **found,
            "shape": str(self.shape.shape),
            "shape_confidence": float(self.shape.confidence),
            "position_m": self.shape.position.tolist(),
            "size": size,
            "rotation_rad": rotation,
        }


@dataclass(frozen=True, eq=False)
class PressReport:
    """A settled press and the pad's readings."""

    shape: str  #: name of the indenter
    model: mujoco.MjModel
    data: mujoco.MjData  #: the scene in its settled state
    commanded: Array  #: force on the indenter [N], pad frame, shape (3,)
    settled: PressResult  #: time, wrench and error of the settled press
    readings: Array  #: von Mises stress [Pa], (layers, rows, columns), or (taxels,) for free taxels
    load: SurfaceLoad  #: tractions on the pad and the state of the contact
    influence: InfluenceMatrices  #: influence matrices of the pad
    law: str  #: contact law
    update_time: float  #: median time of an update [s]
    recognised: RecognisedPress | None = None  #: what recognisers found, if they were asked

    @property
    def contact(self) -> Polygon | MultiPolygon:
        """The part of the surface under pressure, pad frame [m]."""
        return self.load.contact

    @property
    def force_reached(self) -> float:
        """Magnitude of the contact force [N]."""
        return float(np.linalg.norm(self.settled.wrench[:3]))

    @property
    def peaks(self) -> list[Peak]:
        """Highest reading of each sensing layer; for free taxels, of each band of depths that is drawn."""
        pad, found = self.influence.pad, []
        feet = np.concatenate([pad.taxel_feet(layer) for layer in range(pad.sensing_layers)])
        for number, layer in enumerate(pad.layers_drawn):
            taxel = layer[np.argmax(self.readings.ravel()[layer])]
            x, y, depth = feet[taxel].tolist()
            found.append(Peak(pad.depth_said(number), float(self.readings.ravel()[taxel]), (x, y), depth))
        return found

    def as_dict(self) -> dict[str, Any]:
        """The report as plain numbers, in SI units unless the name says otherwise."""
        peaks = self.peaks
        recognised = {} if self.recognised is None else {"recognised": self.recognised.as_dict()}
        return {
            "shape": self.shape,
            "fidelity": fidelity_text(self.influence.fidelity),
            "law": self.law,
            "force_commanded_N": self.commanded.tolist(),
            "force_reached_N": self.settled.wrench[:3].tolist(),
            "moment_reached_Nm": self.settled.wrench[3:].tolist(),
            "force_reached_gf": self.force_reached / GRAM_FORCE,
            "force_error_relative": self.settled.error,
            "settle_time_s": self.settled.time,
            "settle_steps": self.settled.steps,
            "contact_area_m2": self.load.contact_area,
            "indentation_m": self.load.indentation,
            "peak_pressure_Pa": self.load.peak_pressure,
            "depths_m": [float(peak.depth) for peak in peaks],
            "peak_reading_Pa": [peak.reading for peak in peaks],
            "update_s": self.update_time,
            **recognised,
        }

    def save(self, path: Path) -> None:
        """Write readings, wrench and geometry to a compressed .npz; it appears complete or not at all.

        Raises:
            OutputError: the file cannot be written.
        """
        pad = self.influence.pad
        arrays = {
            "readings": self.readings,
            "wrench": self.settled.wrench,
            "commanded_force": self.commanded,
            **_places(pad),
            "contact_wkt": np.array(self.contact.wkt),
            "report_json": np.array(json_text(self.as_dict())),
            "pad_json": np.array(json.dumps(pad.description)),
        }
        write_atomically(path, lambda file: np.savez_compressed(file, allow_pickle=False, **arrays))


@dataclass(frozen=True, kw_only=True)
class PressProblem:
    """An indenter, its force and position on a pad, and the options of the readings."""

    shape: str  #: a punch, "sphere", "cylinder", "box", or the path of a mesh file
    force: Array  #: force on the indenter [N], pad frame, shape (3,)
    pad: Pad  #: the pad
    fidelity: str | Fidelity  #: a preset by name or a Fidelity; its tables are built if the cache lacks them
    law: str | None  #: contact law; None: the fidelity's
    tangential: str  #: distribution of shear, see `contact_load`
    friction: float | None  #: coefficient that bounds the shear [-], see `TactileSensor`
    shift: tuple[float, float]  #: position (x, y) of the indenter's origin in the pad frame [m]
    rotate_deg: float  #: counter-clockwise rotation about its origin, before the shift [deg]
    scale: float | None  #: metres per unit of a mesh file; None: 1
    tilt_free: bool  #: whether the indenter may tilt
    recognise: bool  #: whether recognisers find force and shape from the readings


def run_press(problem: PressProblem) -> PressReport:
    """Press an indenter into the pad until it settles, and read the pad.

    Raises:
        IndenterError: there is no such shape, or a scale for a shape that is no mesh file.
        PresetError: there is no such fidelity.
        ContactError: there is no such law, or it does not allow the requested shear.
        SceneError: the indenter is off the pad, the force is more than the scene can apply, or the press does not
            settle.
        RecognitionError: there are no weights for the pad, and recognisers are asked.
    """
    # The scene is made first, so that its errors appear before a table is built, which may take minutes.
    chosen = as_fidelity(problem.fidelity)
    contact = {"law": problem.law, "tangential": problem.tangential}
    contact_options(chosen, **contact, friction=problem.friction)
    recognise = _recogniser(problem.pad) if problem.recognise else None
    model = _scene(problem)
    data = mujoco.MjData(model)
    settled = press(model, data, problem.force)
    influence = influence_matrices(problem.pad, chosen)
    sensor = TactileSensor(model, influence=influence, **contact, friction=problem.friction)
    update_time = median_time(lambda: sensor.read(data), _TIMED_UPDATES)
    load = sensor.load(data)
    if load is None:
        raise SceneError(f"'{problem.shape}' does not touch the pad after settling. Shift it onto the pad.")
    readings = influence.readings(load)
    return PressReport(
        shape=problem.shape,
        model=model,
        data=data,
        commanded=problem.force,
        settled=settled,
        readings=readings,
        load=load,
        influence=influence,
        law=sensor.law,
        update_time=update_time,
        recognised=None if recognise is None else recognise(readings),
    )


def named_indenter(shape: str, scale: float | None) -> Indenter:
    """The indenter of a name or of a mesh file.

    Args:
        shape: the name or the path of the file.
        scale: metres per unit of the mesh file; None: 1.

    Raises:
        IndenterError: there is neither such an indenter nor such a file, and the message lists the names; or a scale
            is given for a name.
    """
    known = (*INDENTER_NAMES, *OTHER_INDENTERS)
    if shape not in known and Path(shape).suffix:
        return mesh_indenter(shape, name=body_name(Path(shape)), scale=1.0 if scale is None else scale)
    if shape not in known:
        raise IndenterError(
            f"indenter '{shape}' does not exist. Available: {', '.join(known)}, or a mesh file such as tool.stl."
        )
    if scale is not None:
        raise IndenterError(f"--scale is for mesh files; '{shape}' has a size of its own. Leave the option out.")
    return OTHER_INDENTERS[shape]() if shape in OTHER_INDENTERS else punch(shape)


def _recogniser(pad: Pad) -> Callable[[Array], RecognisedPress]:
    """All recognisers: that of faces which cover the pad knows its own, and is asked first."""
    grasp, force = load_recogniser("grasp", pad=pad), load_recogniser("force", pad=pad)
    shape = load_recogniser("shape", pad=pad)

    def recognise(readings: Array) -> RecognisedPress:
        covering = grasp(readings)
        if covering.familiarity is not None and covering.familiarity.familiar:
            return RecognisedPress(covering.force, None, True)
        felt, seen = force(readings), shape(readings)
        known = (one is None or bool(one.familiar) for one in (felt.familiarity, seen.familiarity))
        return RecognisedPress(felt.force, seen, all(known))

    return recognise


def _scene(problem: PressProblem) -> mujoco.MjModel:
    indenter = named_indenter(problem.shape, problem.scale)
    try:
        return press_scene(
            indenter, shift=problem.shift, rotate_deg=problem.rotate_deg, pad=problem.pad, tilt_free=problem.tilt_free
        )
    except MjTactileError:
        raise
    except (ValueError, mujoco.FatalError) as error:  # solids that MuJoCo's compiler refuses
        raise SceneError(f"MuJoCo cannot make a scene of '{indenter.name}': {error}") from error


def _places(pad: Pad) -> dict[str, Array]:
    """Positions of the taxels in the pad frame [m]: x, y and depths of a grid, or points."""
    if isinstance(pad.taxels, FreeTaxels):
        return {"taxels": pad.taxels.positions}
    return {"x": pad.grid.x, "y": pad.grid.y, "depths": np.array(pad.depths)}
