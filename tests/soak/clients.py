"""Hands of other packages under random actions, with pads and without, each package in an environment of its own.

    python tests/soak/clients.py                         # all of them, 20,000 steps each
    python tests/soak/clients.py shadow-block --steps 500

Each package brings the MuJoCo that it runs on; mjtactile is installed there without its dependencies' bounds, and
without torch, which reading a pad does not need.
"""

from __future__ import annotations

import argparse
import contextlib
import json
import re
import subprocess
import sys
import time
import warnings
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

from client_venvs import install
from warning_texts import without_numbers

HERE = Path(__file__).resolve().parent
ROOT = HERE.parents[1]


class World(Protocol):
    """An environment under random actions."""

    def reset(self) -> None:
        """Begin anew."""

    def step(self) -> bool:
        """One step with a random action; whether the episode is over."""
        ...

    def simulation(self) -> tuple[Any, Any]:
        """Its MuJoCo model and data as they are now."""
        ...


@dataclass(frozen=True)
class Client:
    """A task of another package."""

    venv: str  #: key of `client_venvs.VENVS`
    make: Callable[[str, int], World]  #: from a task's name and a seed
    task: str
    episode: int = 100  #: steps after which it begins anew


# ------------------------------------------------------------------------------------------- inside an environment


def _shadow(task: str, seed: int) -> World:
    """The Shadow hand with five pads by the recipe of docs/hands.md, on the environment's own time step."""
    import gymnasium
    import gymnasium_robotics
    import mujoco
    from gymnasium_robotics.envs import robot_env

    gymnasium.register_envs(gymnasium_robotics)
    recipe = _recipe()

    class MujocoWithPads:
        """MuJoCo as the environment knows it, but for models."""

        class MjModel:
            @staticmethod
            def from_xml_path(path: str) -> mujoco.MjModel:
                spec = recipe["shadow_hand"](Path(path).name, "fast")
                spec.option.timestep = mujoco.MjSpec.from_file(path).option.timestep
                return spec.compile()

        def __getattr__(self, name: str) -> Any:
            return getattr(mujoco, name)

    before = robot_env.MujocoRobotEnv._initialize_simulation

    def initialize(self: Any) -> None:
        self._mujoco = MujocoWithPads()
        before(self)

    robot_env.MujocoRobotEnv._initialize_simulation = initialize
    environment = gymnasium.make(task)
    environment.action_space.seed(seed)

    class Shadow:
        def reset(self) -> None:
            environment.reset(seed=seed)

        def step(self) -> bool:
            _, _, terminated, truncated, _ = environment.step(environment.action_space.sample())
            return terminated or truncated

        def simulation(self) -> tuple[Any, Any]:
            hand: Any = environment.unwrapped
            return hand.model, hand.data

    return Shadow()


def _recipe() -> dict[str, Any]:
    """What the first block of docs/hands.md on the Shadow hand defines, up to where it is used."""
    section = (ROOT / "docs" / "hands.md").read_text().split("## Shadow hand (gymnasium-robotics)")[1]
    block = re.findall(r"```python\n(.*?)```", section, flags=re.DOTALL)[0].split("\nspec = ")[0]
    names: dict[str, Any] = {}
    exec(compile(block, "docs/hands.md", "exec"), names)
    return names


#: Whether pads have sensors; geoms alone serve for comparison, since contacts are the same.
_sensors = [True]


def _geoms_alone() -> None:
    """Let attach_pad add geoms that nothing reads."""
    import mjtactile.attach

    mjtactile.attach.add_pad_sensor = lambda *_: None
    _sensors[0] = False


def _robosuite(task: str, seed: int) -> World:
    """Lift with the robot `task`: pads on the two fingers of the Panda's gripper, or on every fingertip."""
    import mujoco
    import numpy as np
    import robosuite  # pyright: ignore[reportMissingImports]

    import mjtactile

    def with_pads(xml: str) -> str:
        spec = mujoco.MjSpec.from_string(xml)
        if task == "Panda":
            for finger, side in ((1, 1.0), (2, -1.0)):
                body = f"gripper0_right_finger_joint{finger}_tip"
                pos, quat = (0, -0.01 * side, -0.015), (1, side, 0, 0)
                mjtactile.attach_pad(spec, body=body, name=f"touch{finger}", pos=pos, quat=quat, fidelity="fast")
        else:
            fingers = ("thumb", "index", "middle", "ring", "pinky")
            fingertip_pads(spec, [f"gripper0_right_r_{finger}_distal" for finger in fingers])
        spec.compile()
        return spec.to_xml()

    environment = robosuite.make(
        "Lift", robots=task, has_renderer=False, has_offscreen_renderer=False, use_camera_obs=False, horizon=10**9,
        seed=seed,
    )  # fmt: skip
    environment.set_xml_processor(with_pads)
    rng = np.random.default_rng(seed)
    low, high = environment.action_spec

    class Robosuite:
        def reset(self) -> None:
            environment.reset()

        def step(self) -> bool:
            """At random, but drawn to the cube: a random arm hardly ever touches it."""
            action, scene = rng.uniform(low, high), environment.sim.data
            hand = scene.site_xpos[environment.robots[0].eef_site_id["right"]]
            way = scene.body_xpos[environment.cube_body_id] - hand
            action[:3] = np.clip(20 * way + 0.5 * action[:3], -1, 1)
            return bool(environment.step(action)[2])

        def simulation(self) -> tuple[Any, Any]:
            return environment.sim.model._model, environment.sim.data._data

    return Robosuite()


def _jaco(task: str, seed: int) -> World:
    """The Jaco arm and hand of dm_control with a pad on each of its three fingertips, written in its own MJCF."""
    import numpy as np
    from dm_control import manipulation, mjcf  # pyright: ignore[reportMissingImports]

    from mjtactile.sim.pad_geom import contact_constants

    before = mjcf.Physics.from_mjcf_model

    def from_mjcf_model(model: Any) -> Any:
        tips = [body for body in model.find_all("body") if "finger_tip" in (getattr(body, "name", "") or "")]
        if not any(getattr(geom, "name", "") == "pad0" for geom in tips[0].find_all("geom")):
            physics = before(model)
            frames = fingertips(physics.model.ptr, physics.data.ptr, [tip.full_identifier for tip in tips])
            plain = tips[0].root.default.add("default", dclass="touch")  # the fingers' class brings a mesh along
            look: Any = {"contype": 1, "conaffinity": 1, "dclass": plain, **contact_constants("stiff")}
            for number, (tip, (pos, quat)) in enumerate(zip(tips, frames, strict=True)):
                frame = tip.add("body", name=f"touch{number}", pos=pos, quat=quat)
                half = (7.5e-3, 7.5e-3, 2.5e-3)
                geom = frame.add("geom", name=f"pad{number}", type="box", size=half, pos=(0, 0, -half[2]), **look)
                if _sensors[0]:
                    sensor = {"name": f"touch{number}", "plugin": "mjtactile.pad"}
                    read = model.sensor.add("plugin", **sensor, objtype="geom", objname=geom.full_identifier)
                    read.add("config", key="fidelity", value="fast")
            if _sensors[0]:
                model.extension.add("plugin", plugin="mjtactile.pad")
        return before(model)

    mjcf.Physics.from_mjcf_model = staticmethod(from_mjcf_model)
    environment = manipulation.load(task, seed=seed)
    rng = np.random.default_rng(seed)
    actions = environment.action_spec()

    rest = actions.minimum.shape[0] - 3
    state = {"steps": 0}
    held = rng.uniform(actions.minimum, actions.maximum)

    class Jaco:
        def reset(self) -> None:
            environment.reset()

        def step(self) -> bool:
            """At random, each action for a while, and the fingers close and open: else they never touch anything."""
            if state["steps"] % 25 == 0:
                held[:] = rng.uniform(actions.minimum, actions.maximum)
                held[rest:] = (actions.minimum if state["steps"] // 100 % 2 else actions.maximum)[rest:]
            state["steps"] += 1
            return bool(environment.step(held).last())

        def simulation(self) -> tuple[Any, Any]:
            return environment.physics.model.ptr, environment.physics.data.ptr

    return Jaco()


def fingertip_pads(spec: Any, bodies: list[str]) -> None:
    """Pads of 10 x 12 x 5 mm on bodies of a model, where `fingertips` says."""
    import mujoco
    import random_scenes

    import mjtactile

    model = spec.compile()
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    pad = random_scenes.PADS["10x12x5"].pad
    for number, (body, (pos, quat)) in enumerate(zip(bodies, fingertips(model, data, bodies), strict=True)):
        mjtactile.attach_pad(spec, body=body, name=f"touch{number}", pos=pos, quat=quat, pad=pad, fidelity="fast")


def fingertips(model: Any, data: Any, bodies: list[str]) -> list[tuple[Any, Any]]:
    """Places of pads on the largest geom of each body, on the side that faces the middle between all the bodies.

    Returns: position [m] and quaternion of each pad's frame in its body; y along the finger, half a millimetre proud.
    """
    import mujoco
    import numpy as np

    middle = np.mean([data.body(body).xpos for body in bodies], axis=0)
    places = []
    for body in bodies:
        here = model.body(body)
        geoms = range(int(here.geomadr[0]), int(here.geomadr[0]) + int(here.geomnum[0]))
        geom = max((g for g in geoms if model.geom_contype[g]), key=lambda g: model.geom_rbound[g])
        centre, half = model.geom_aabb[geom].reshape(2, 3)
        turn = data.geom_xmat[geom].reshape(3, 3)
        towards = turn.T @ (middle - data.geom_xpos[geom]) - centre
        along = np.eye(3)[int(half.argmax())]
        axis = max((axis for axis in range(3) if not along[axis]), key=lambda axis: abs(towards[axis]))
        normal = np.sign(towards[axis]) * np.eye(3)[axis]
        frame = np.column_stack([np.cross(along, normal), along, normal])
        in_body = data.body(body).xmat.reshape(3, 3).T
        surface = data.geom_xpos[geom] + turn @ (centre + normal * (half[axis] + 5e-4))
        quat = np.empty(4)
        mujoco.mju_mat2Quat(quat, np.ascontiguousarray(in_body @ turn @ frame).ravel())
        places.append((in_body @ (surface - data.body(body).xpos), quat))
    return places


CLIENTS = {
    "shadow-block": Client("gymnasium-robotics", _shadow, "HandManipulateBlock-v1"),
    "shadow-egg": Client("gymnasium-robotics", _shadow, "HandManipulateEgg-v1"),
    "shadow-pen": Client("gymnasium-robotics", _shadow, "HandManipulatePen-v1"),
    "shadow-reach": Client("gymnasium-robotics", _shadow, "HandReach-v3", 50),
    "panda-lift": Client("robosuite", _robosuite, "Panda", 500),
    "inspire-lift": Client("robosuite", _robosuite, "PandaDexRH", 500),
    "jaco": Client("dm-control", _jaco, "lift_large_box_features", 500),
}


def act(name: str, steps: int, seed: int, pads: bool, limit: float) -> dict[str, Any]:
    """Drive a client here, in its environment, for so many steps or seconds.

    Returns: steps taken and steps per second of processor time, the slowest step and its number, steps in which
        something was read, steps with numbers that are not finite, calls into Python from within MuJoCo's steps,
        warnings.
    """
    import numpy as np

    client = CLIENTS[name]
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of the packages' own
        if not pads:
            _geoms_alone()
        world = client.make(client.task, seed)
        world.reset()
        world.step()  # what is compiled or built at the first step is not counted
        world.reset()
    calls, spent = Counter[str](), []
    read = not_finite = 0
    over, until = False, time.monotonic() + limit
    with warnings.catch_warnings(record=True) as heard, _counted(calls):
        warnings.simplefilter("always")
        for step in range(steps):
            if time.monotonic() > until:
                break
            if over or (step and step % client.episode == 0):
                world.reset()
            begin = time.thread_time()
            over = world.step()
            spent.append(time.thread_time() - begin)
            numbers = _readings(*world.simulation())
            read += bool(numbers.any())
            not_finite += not np.isfinite(numbers).all()
    ours = [one for one in heard if "mjtactile" in f"{one.category.__module__} {one.filename}"]
    texts = Counter(without_numbers(str(one.message)) for one in ours)
    return {
        "steps": len(spent),
        "steps_per_s": len(spent) / sum(spent),
        "slowest_ms": 1e3 * max(spent),
        "slowest_step": int(np.argmax(spent)),
        "high_ms": 1e3 * float(np.percentile(spent, 99.9)),
        "read": read,
        "not_finite": not_finite,
        "python_calls": calls["call"],
        "warnings": dict(texts.most_common(5)),
        "repeated_warnings": sum(count - 1 for count in texts.values()),
    }


def _readings(model: Any, data: Any) -> Any:
    """All numbers of the pads' sensors."""
    import mujoco
    import numpy as np

    ours = np.flatnonzero(model.sensor_type == int(mujoco.mjtSensor.mjSENS_PLUGIN))
    parts = [data.sensordata[model.sensor_adr[s] : model.sensor_adr[s] + model.sensor_dim[s]] for s in ours]
    return np.concatenate(parts) if parts else np.empty(0)


@contextlib.contextmanager
def _counted(calls: Counter[str]) -> Iterator[None]:
    """Count calls into Python from within MuJoCo's functions that read sensors."""
    import mujoco

    names = ("mj_step", "mj_step1", "mj_step2", "mj_forward")
    before = {name: getattr(mujoco, name) for name in names}

    def count(_frame: object, event: str, _argument: object) -> None:
        calls[event] += 1

    def watched(function: Callable[..., None]) -> Callable[..., None]:
        def call(*arguments: Any, **named: Any) -> None:
            sys.setprofile(count)
            try:
                function(*arguments, **named)
            finally:
                sys.setprofile(None)

        return call

    for name, function in before.items():
        setattr(mujoco, name, watched(function))
    try:
        yield
    finally:
        for name, function in before.items():
            setattr(mujoco, name, function)


# -------------------------------------------------------------------------------------------------- from outside


def run(name: str, steps: int, seed: int, folder: Path, limit: float) -> tuple[list[str], str]:
    """Run a client with pads and without, in processes of its environment.

    Returns: what is wrong, and a line that says how it went.
    """
    python = install(CLIENTS[name].venv, folder)
    answers = []
    for pads in (False, True):
        command = [str(python), str(HERE / "clients.py"), "--act", name, "--steps", str(steps), "--seed", str(seed)]
        command += ["--limit", str(limit), *([] if pads else ["--no-pads"])]
        kept = folder / "clients" / f"{name}{'' if pads else '-without'}.txt"
        kept.parent.mkdir(parents=True, exist_ok=True)
        try:
            ended = subprocess.run(
                command, capture_output=True, text=True, timeout=limit + 120, check=False, cwd=kept.parent
            )
        except subprocess.TimeoutExpired as error:
            kept.write_text(_as_text(error.stderr))
            return ["hangs"], f"{name}: no end within {limit + 120:g} s; see {kept}"
        kept.write_text(ended.stderr)
        if ended.returncode:
            how = f"ended with {ended.returncode}" if ended.returncode > 0 else f"died of signal {-ended.returncode}"
            return ["crashes"], f"{name}{'' if pads else ' without pads'}: {how}: {_why(ended.stderr)}; see {kept}"
        answers.append(json.loads(ended.stdout.splitlines()[-1]))
        if pads and "Traceback (most recent call last)" in ended.stderr:
            answers[-1]["traceback"] = ended.stderr.count("Traceback (most recent call last)")
    without, touched = answers
    wrong = [kind for kind in ("not_finite", "python_calls", "repeated_warnings", "traceback") if touched.get(kind)]
    if touched["steps"] < steps:
        wrong.append("too slow")
        touched["too slow"] = f"for {steps} steps in {limit:g} s"
    counts = "".join(f", {kind} {touched[kind]}" for kind in wrong)
    line = (
        f"{name}: {touched['steps_per_s']:.0f} steps/s with pads, {without['steps_per_s']:.0f} without; slowest "
        f"{touched['slowest_ms']:.1f} ms (step {touched['slowest_step']}), without {without['slowest_ms']:.1f} ms, "
        f"99.9 % {touched['high_ms']:.1f} ms; something read in {touched['read']} of {touched['steps']} steps{counts}"
    )
    return wrong, line


def _why(said: str) -> str:
    """Where a process was, innermost first, or the exception with which it ended."""
    lines = said.strip().splitlines()
    if any(line.startswith("Fatal Python error") for line in lines):
        frames = [line.strip() for line in lines if line.startswith('  File "')]
        return " < ".join(re.sub(r'File ".*/([^/]+)", line', r"\1", frame) for frame in frames[:4])
    return lines[-1][:200] if lines else "nothing was said"


def _as_text(said: bytes | str | None) -> str:
    return said.decode(errors="replace") if isinstance(said, bytes) else said or ""


def main() -> int:
    """The command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("clients", nargs="*", metavar="client", help=f"of {', '.join(CLIENTS)}; all by default")
    parser.add_argument("--steps", type=int, default=20_000)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--limit", type=float, default=7200.0, help="seconds for one client")
    parser.add_argument("--out", type=Path, default=ROOT / "build" / "soak")
    parser.add_argument("--act", help=argparse.SUPPRESS)
    parser.add_argument("--no-pads", action="store_true", help=argparse.SUPPRESS)
    given = parser.parse_args()
    if given.act:
        import faulthandler

        faulthandler.enable()
        print(json.dumps(act(given.act, given.steps, given.seed, not given.no_pads, given.limit)))
        return 0
    if unknown := [name for name in given.clients if name not in CLIENTS]:
        parser.error(f"there is no client {unknown[0]!r}. Available: {', '.join(CLIENTS)}.")
    failed = []
    for name in given.clients or CLIENTS:
        wrong, line = run(name, given.steps, given.seed, given.out.resolve(), given.limit)
        failed += [f"{name}: {kind}" for kind in wrong]
        print(line, flush=True)
    print(f"FAILED: {', '.join(failed)}" if failed else "passed")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
