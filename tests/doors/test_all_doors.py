"""One contact, read through every door: the same law, the same fidelity, the same numbers."""

from __future__ import annotations

import ast
from collections.abc import Callable
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pytest
from shapely import MultiPoint, Polygon, box

import mjtactile
from mjtactile.envs.press_identify import PressIdentify
from mjtactile.envs.simulation import SingleSimulation
from mjtactile.envs.single import TactileEnv
from mjtactile.fidelity import DEFAULT, Fidelity, as_fidelity
from mjtactile.influence.surface_load import SurfaceLoad
from mjtactile.sim.mjcf import SHOWN
from mjtactile.sim.render import render_scene
from mjtactile.sim.wrench import geom_frame
from mjtactile.torch.model import PadModel

#: None asks for nothing, which is "balanced" at every door.
ASKED = [None, "fast", Fidelity(mesh="draft", precision="float16", law="elastic", cells=40)]


def pressed(**said: Any) -> tuple[TactileEnv, np.ndarray]:
    """A finger that presses a square obliquely in an environment, and the readings the agent is given [Pa]."""
    env = TactileEnv(PressIdentify, observation="pascals", noise=0.0, **said)
    env.reset(seed=3, options={"shape": "square"})
    action = np.zeros(env.action_space.shape or (), dtype=np.float32)
    action[:5] = 0.05, -0.02, 0.0, 0.5, -1.0
    observed: dict[str, Any] = {}
    for _ in range(20):
        observed, *_ = env.step(action)
    return env, np.array(observed["tactile"])[0]


def square_on(model: mujoco.MjModel, data: mujoco.MjData) -> Polygon:
    """The face of the punch that presses, pad frame [m]."""
    frame = geom_frame(model, data, model.geom("finger_pad").id)
    shown = model.geom(f"on_table_square{SHOWN}").id
    mesh = model.mesh(int(model.geom_dataid[shown]))
    vertices = model.mesh_vert[int(mesh.vertadr[0]) :][: int(mesh.vertnum[0])]
    world = vertices @ data.geom_xmat[shown].reshape(3, 3).T + data.geom_xpos[shown]
    seen = (world - frame.position) @ frame.rotation
    face = MultiPoint(seen[seen[:, 2] < seen[:, 2].min() + 1e-3, :2]).convex_hull
    assert isinstance(face, Polygon)
    return face


@pytest.mark.parametrize("asked", ASKED, ids=["default", "a preset's name", "a fidelity"])
def test_the_same_contact_is_read_the_same_through_every_door(asked):
    chosen = as_fidelity(DEFAULT if asked is None else asked)
    said: dict[str, Any] = {} if asked is None else {"fidelity": asked}
    env, told = pressed(**said)
    simulation = env.task.simulation
    assert isinstance(simulation, SingleSimulation)
    model, data = simulation.model, simulation.data

    by_plugin = mjtactile.TactileSensor(model, "finger")  # reads what the engine put into `sensordata`
    sensor = mjtactile.TactileSensor(model, geom="finger_pad", **said)
    influence = mjtactile.influence_matrices(**said)
    module = PadModel(**said)
    for one in (by_plugin.influence, sensor.influence, influence, module):
        assert one.fidelity == chosen
    assert by_plugin.law == sensor.law == chosen.law

    face = mjtactile.Footprint.from_outline(square_on(model, data), influence.surface)
    wrench = sensor.wrench(data)
    load = mjtactile.contact_load(influence, face, wrench[:3], moment=wrench[3:])
    expected = sensor.read(data)
    peak = expected.max()
    assert peak > 1e3
    # The core solves it everywhere; only the module and what an agent is given are in single precision.
    np.testing.assert_allclose(by_plugin.read(data), expected, atol=1e-9 * peak)
    # A contact of one's own is not at the pose of the scene, which the sensor takes in steps of 2^-44 m: its forces are
    # the same to rounding, and its readings, sums in single precision, to their last places.
    carried = sensor.load(data)
    assert carried is not None
    np.testing.assert_allclose(load.forces, carried.forces, rtol=0, atol=1e-9 * float(np.abs(carried.forces).max()))
    np.testing.assert_allclose(influence.readings(load), expected, rtol=5e-7, atol=1e-9 * peak)
    np.testing.assert_allclose(told, expected, atol=1e-6 * peak)
    np.testing.assert_allclose(module(module.nodal_forces(load)).numpy(), expected, atol=2e-6 * peak)


def on_a_finger(**said: Any) -> tuple[mujoco.MjModel, mujoco.MjData]:
    spec = mujoco.MjSpec.from_string('<mujoco><worldbody><body name="finger"/></worldbody></mujoco>')
    mjtactile.attach_pad(spec, body="finger", name="ff", fidelity="fast", **said)
    model = spec.compile()
    return model, mujoco.MjData(model)


#: Calls with an argument of a wrong type, and its name and the type it must have.
WRONG: list[tuple[Callable[[Any, Any, Any], Any], str, str]] = [
    (lambda model, _, wrong: mjtactile.TactileSensor(model, influence=wrong), "influence", "InfluenceMatrices"),
    (lambda model, _, wrong: mjtactile.plugin_health(model, wrong, "ff"), "data", "MjData"),
    (lambda _, data, wrong: mjtactile.plugin_health(wrong, data, "ff"), "model", "MjModel"),
    (lambda model, _, wrong: mjtactile.press(model, wrong, (0, 0, -1)), "data", "MjData"),
    (lambda _, data, wrong: mjtactile.press(wrong, data, (0, 0, -1)), "model", "MjModel"),
    (lambda _, __, wrong: mjtactile.contact_load(wrong, wrong, (0, 0, -1)), "influence", "InfluenceMatrices"),
    (lambda _, __, wrong: mjtactile.contact_load(fast(), wrong, (0, 0, -1)), "footprint", "Footprint"),
    (lambda _, __, wrong: mjtactile.WrenchBasis(fast(), wrong), "footprint", "Footprint"),
    (lambda _, __, wrong: fast().readings(wrong), "load", "SurfaceLoad"),
    (lambda _, __, wrong: PadModel(fast()).nodal_forces(wrong), "load", "SurfaceLoad"),
    (lambda _, __, wrong: mjtactile.set_warnings(wrong), "enabled", "bool"),
    (lambda model, data, wrong: mjtactile.preview_pad(wrong, "ff", data=data), "model", "MjModel"),
    (lambda model, _, wrong: mjtactile.preview_pad(model, "ff", data=wrong), "data", "MjData"),
    (lambda _, __, wrong: mjtactile.press_scene("star", pad=wrong), "pad", "Pad"),
    (lambda _, __, wrong: on_a_finger(visual=wrong), "visual", "bool"),
    (lambda _, __, wrong: fast().readings_of(wrong), "response", "ndarray"),
    (lambda _, __, wrong: SurfaceLoad.from_tractions(wrong, box(0, 0, 1, 1), np.cross), "influence", "PadTables"),
    (lambda _, __, wrong: mjtactile.Footprint.from_outline(box(0, 0, 1, 1), wrong), "surface", "SurfaceGrid"),
    (lambda _, __, wrong: mjtactile.Footprint.from_gap(np.hypot, wrong), "surface", "SurfaceGrid"),
    (lambda _, __, wrong: mjtactile.Footprint.from_height(np.hypot, wrong), "surface", "SurfaceGrid"),
]
#: Calls with a name that is no text, and the argument.
NAMED: list[tuple[Callable[[Any, Any, Any], Any], str]] = [
    # None stands for the default.
    (lambda model, _, wrong: mjtactile.TactileSensor(model, geom=wrong or 3), "geom"),  # type: ignore[arg-type]
    (lambda model, _, wrong: mjtactile.preview_pad(model, wrong), "pad"),
    (lambda model, data, wrong: render_scene(model, data, camera=wrong or 0), "camera"),
]


@pytest.mark.parametrize("wrong", ["none", 3], ids=["a text", "a number"])
@pytest.mark.parametrize(("door", "name", "kind"), WRONG)
def test_an_argument_of_another_type_is_refused_by_its_name(door, name, kind, wrong):
    said = rf"^{name} is of type {type(wrong).__name__}; expected (a|the) (\w+\.)?{kind}"
    with pytest.raises(mjtactile.MjTactileError, match=said):
        door(*on_a_finger(), wrong)


@pytest.mark.parametrize("wrong", [None, 3, ["ff"]], ids=str)
@pytest.mark.parametrize(("door", "name"), NAMED)
def test_a_name_is_a_text(door, name, wrong):
    """MuJoCo itself looks None up where there is no memory."""
    with pytest.raises(mjtactile.MjTactileError, match=rf"^{name} is of type \w+; expected a str"):
        door(*on_a_finger(), wrong)


def fast() -> mjtactile.InfluenceMatrices:
    return mjtactile.influence_matrices(fidelity="fast")


def test_no_loads_are_no_readings():
    module = PadModel(fast())
    forces = module.nodal_forces([])
    assert forces.shape == (0, *module.force_shape)
    assert module(forces).shape == fast().readings([]).shape


#: The study repeats the paper, which took its readings from a fine finite element model.
OF_ITS_OWN = {"experiments/study/plan.py"}


def test_every_default_of_a_fidelity_is_the_default():
    package = Path(mjtactile.__file__).parent
    found = []
    for file in package.rglob("*.py"):
        for node in ast.walk(ast.parse(file.read_text())):
            if isinstance(node, ast.FunctionDef):
                positional = node.args.posonlyargs + node.args.args
                defaults = [None] * (len(positional) - len(node.args.defaults)) + node.args.defaults
                named = zip(positional + node.args.kwonlyargs, defaults + node.args.kw_defaults, strict=True)
                found += [(file, value) for of, value in named if of.arg == "fidelity" and value is not None]
            elif isinstance(node, ast.AnnAssign) and ast.unparse(node.target) == "fidelity" and node.value is not None:
                found.append((file, node.value))
    told = {str(file.relative_to(package)) for file, value in found if ast.unparse(value) not in ("DEFAULT", "None")}
    assert len(found) > 15
    assert told == OF_ITS_OWN
