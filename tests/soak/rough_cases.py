"""Contacts that a new user meets on the first day, each by a name: corners, edges, rings, feet, halos, changed models.

`load(name)` gives a model and its data, posed. It has been settled with the sensors switched off, so that nothing is
read until the caller calls `mj_forward` or `mj_step`, and MuJoCo presses with `CASES[name].force`. Sensors are called
"touch"; a second pad's is "touch2".
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import meshes
import mujoco
import numpy as np

import mjtactile
from mjtactile.sim.pad_geom import contact_attributes

#: Thrust of a gram [N].
GF = 9.80665e-3
#: Contact of a pad as attach_pad makes it.
CONTACT = " ".join(f'{name}="{value}"' for name, value in contact_attributes("stiff").items())
_SETTLING_STEPS = 1500
_READ_EVERYTHING = "von_mises wrench"


@dataclass(frozen=True)
class Case:
    """One contact.

    Attributes:
        about: what is tried, in a line.
        world: MJCF of the world's bodies; the pad's geom, its sensor and the options are added. A body that presses has
            a slide joint "press" along z, on which the force acts; without one the case is only posed, or falls.
        force: on that joint towards the pad [N]; 0 where nothing is known beforehand.
        assets: MJCF of meshes and height fields, without the element around.
        extensions: MJCF of other plugins, without the element around.
        pad: size of the sheet (x, y, thickness) [m].
        pad_body: MJCF of what stands around the pad's geom, "{pad}" in its place; by default it belongs to the world.
        mirrors: mirror planes of the scene, geometry and MuJoCo's wrench: "x" where x -> -x changes nothing, and "y".
        law: contact law; empty for the fidelity's.
        sleep: whether bodies may fall asleep.
        steps: over which the case is interesting: 1 where it is at rest.
        velocity: of the joints at the beginning [m/s, rad/s].
        change: done to the model after the pad has been read once and before the body settles.
    """

    about: str
    world: str
    force: float = 0.0
    assets: str = ""
    extensions: str = ""
    pad: tuple[float, float, float] = (15e-3, 15e-3, 5e-3)
    pad_body: str = "{pad}"
    mirrors: str = ""
    law: str = ""
    sleep: bool = False
    steps: int = 1
    velocity: tuple[float, ...] = ()
    change: Callable[[mujoco.MjModel], None] | None = None


def load(
    name: str, *, fidelity: str = "fast", law: str = "", output: str = _READ_EVERYTHING
) -> tuple[mujoco.MjModel, mujoco.MjData]:
    """Model and data of a case, posed and settled; nothing has been read of the pose as it is.

    Args:
        name: of the case, a key of CASES.
        fidelity: preset by name.
        law: contact law; empty for the case's, or the fidelity's.
        output: of the sensors.
    """
    case = CASES[name]
    model = mujoco.MjModel.from_xml_string(xml(name, fidelity=fidelity, law=law, output=output))
    data = mujoco.MjData(model)
    if case.change is not None:
        pressed(model, data, case.force)
        mujoco.mj_forward(model, data)  # what is kept of the geometry is made here, where nothing has changed yet
        case.change(model)
        mujoco.mj_resetData(model, data)
    if case.force:
        pressed(model, data, case.force)
    if case.velocity:
        data.qvel[:] = case.velocity
    return model, data


def pressed(model: mujoco.MjModel, data: mujoco.MjData, force: float) -> None:
    """Let what has joints "press..." settle under a force [N] along -z, without reading anything meanwhile."""
    flags = model.opt.disableflags
    model.opt.disableflags = flags | mujoco.mjtDisableBit.mjDSBL_SENSOR
    for joint in range(model.njnt):
        if model.joint(joint).name.startswith("press"):
            data.qfrc_applied[model.jnt_dofadr[joint]] = -force
    mujoco.mj_step(model, data, _SETTLING_STEPS)
    data.qvel[:] = 0.0
    model.opt.disableflags = flags


def xml(name: str, *, fidelity: str = "fast", law: str = "", output: str = _READ_EVERYTHING) -> str:
    """A case by its name as MJCF; its pad is registered on the way, where it is not the default one."""
    return mjcf(CASES[name], name, fidelity=fidelity, law=law, output=output)


def mjcf(case: Case, name: str, *, fidelity: str = "fast", law: str = "", output: str = _READ_EVERYTHING) -> str:
    """A case as MJCF under a name; see `xml`."""
    length, width, thickness = case.pad
    box = (
        f'<geom name="pad" type="box" size="{length / 2:.9g} {width / 2:.9g} {thickness / 2:.9g}" '
        f'pos="0 0 {-thickness / 2:.9g}" {CONTACT}/>'
    )
    chosen = law or case.law
    config = "".join(
        f'<config key="{key}" value="{value}"/>'
        for key, value in (("pad", pad_name(case.pad)), ("fidelity", fidelity), ("law", chosen), ("output", output))
        if value
    )
    names = ["pad"] + ["pad2"] * ('name="pad2"' in case.world)
    sensors = "".join(
        f'<plugin name="touch{geom[3:]}" plugin="mjtactile.pad" objtype="geom" objname="{geom}">{config}</plugin>'
        for geom in names
    )
    return f"""<mujoco model="{name}">
  <compiler angle="degree"/>
  <option timestep=".001" gravity="0 0 {0 if case.force else -9.81:g}" integrator="implicitfast" cone="elliptic"
    impratio="10" jacobian="dense" tolerance="1e-14" iterations="200" ls_iterations="100">
    {'<flag sleep="enable"/>' if case.sleep else ""}</option>
  <extension><plugin plugin="mjtactile.pad"/>{case.extensions}</extension>
  <asset>{case.assets}</asset>
  <worldbody>{case.pad_body.format(pad=box)}{case.world}</worldbody>
  <sensor>{sensors}</sensor>
</mujoco>"""


def pad_name(size: tuple[float, float, float]) -> str:
    """Name under which a sheet of a size (x, y, thickness) [m] is registered: PDMS, at most 13 x 13 taxels."""
    if size == (15e-3, 15e-3, 5e-3):
        return "default"
    name = "soak-" + "x".join(f"{length * 1e3:g}".replace(".", "p") for length in size)
    mjtactile.register_pad(name, sheet(size))
    return name


def sheet(size: tuple[float, float, float]) -> mjtactile.Pad:
    """A sheet of PDMS of a size (x, y, thickness) [m], felt at a quarter and three quarters of its thickness."""
    length, width, thickness = size
    columns, rows = (max(3, min(13, round(side / 1.2e-3))) for side in (length, width))
    return mjtactile.Pad(
        size=(length, width),
        layers=(mjtactile.Layer(thickness=thickness, young=3e6, poisson=0.49),),
        taxels=mjtactile.TaxelGrid(rows=rows, columns=columns, pitch=(length / (columns + 1), width / (rows + 1))),
        depths=(thickness / 4, 3 * thickness / 4),
        sampling_radius=min(0.625e-3, thickness / 8, length / 16, width / 16),
    )


def on_slide(
    geoms: str, height: float, *, at: tuple[float, float] = (0.0, 0.0), turn: str = "", number: str = ""
) -> str:
    """A body on a slide above the pad: its origin `height` [m] above the sensing surface."""
    return (
        f'<body pos="{at[0]:.9g} {at[1]:.9g} {height:.9g}">'
        f'<joint name="press{number}" type="slide" axis="0 0 1" damping="10"/><body name="body{number}" {turn}>'
        f'<inertial pos="0 0 0" mass=".05" diaginertia="1e-5 1e-5 1e-5"/>{geoms}</body></body>'
    )


def _falling_pad(world: str, **options: Any) -> Case:
    """The pad, face down, on a slide above what is fixed in the world."""
    around = (
        '<body name="finger" pos="0 0 .0025" quat="0 1 0 0"><joint name="press" type="slide" axis="0 0 -1" '
        'damping="10"/><inertial pos="0 0 0" mass=".05" diaginertia="1e-5 1e-5 1e-5"/>{pad}</body>'
    )
    return Case(world=world, pad_body=around, **options)


def _feet(count: int) -> Case:
    turn = 2 * np.pi * np.arange(count) / count
    feet = "".join(
        f'<geom type="sphere" size=".0015" pos="{4e-3 * np.cos(t):.9g} {4e-3 * np.sin(t):.9g} 0"/>' for t in turn
    )
    plate = '<geom type="cylinder" size=".006 .001" pos="0 0 .003" contype="0" conaffinity="0"/>'
    mirrors = "xy" if count % 2 == 0 else "y"
    return Case(f"a rigid body on {count} ball feet", on_slide(feet + plate, 1.6e-3), 0.5, mirrors=mirrors)


def _grid_of_feet(count: int) -> Case:
    places = 2e-3 * (np.arange(count) - (count - 1) / 2)
    feet = "".join(f'<geom type="sphere" size=".001" pos="{x:.9g} {y:.9g} 0"/>' for x in places for y in places)
    return Case(f"a rigid body on {count * count} ball feet, 2 mm apart", on_slide(feet, 1.1e-3), 0.1, mirrors="xy")


def _rods(count: int) -> Case:
    rods = "".join(
        f'<geom type="capsule" size=".001 .004" pos="{x:.9g} 0 0" quat=".70710678118654752 .70710678118654752 0 0"/>'
        for x in 3e-3 * (np.arange(count) - (count - 1) / 2)
    )
    return Case(f"{count} lying rods of one body, 3 mm apart", on_slide(rods, 1.1e-3), 0.8, mirrors="xy")


def _notched() -> Case:
    """A bar on a side that is all but flat: two planes that meet in its middle, .1 degrees steep."""
    outline = 1e-3 * np.array([[-2, -2], [0, -1.997], [2, -2], [2, 2], [-2, 2]])
    vertices, faces = meshes.prism(outline, 4e-3)
    lying = np.column_stack([vertices[:, 2] - 2e-3, vertices[:, 0], vertices[:, 1]])
    return Case(
        "a bar of 4 mm on a side with a notch of 3 um along its middle",
        on_slide('<geom type="mesh" mesh="bar"/>', 2.1e-3),
        0.5,
        assets=meshes.mjcf("bar", (lying, faces)),
        mirrors="xy",
    )


def _ring(
    middle: float,
    tube: float,
    force: float,
    *,
    aside: float = 0.0,
    across: float = 0.0,
    sections: tuple[int, int] = (48, 24),
    mirrors: str = "",
) -> Case:
    return Case(
        f"a lying ring of {middle * 2e3:g} mm with a cord of {tube * 2e3:g} mm, a mesh, {aside * 1e6:g} um aside",
        on_slide('<geom type="mesh" mesh="torus"/>', tube + 1e-4, at=(aside, across)),
        force,
        assets=meshes.mjcf("torus", meshes.torus(middle, tube, *sections)),
        mirrors=mirrors,
    )


def _bars(bars: Sequence[tuple[float, float, float, float]], *, aside: float = 0.0) -> Case:
    """A rigid figure of round bars [mm] that lie along the pad's axes, so that lines of cells run along them."""
    capsules = "".join(
        f'<geom type="capsule" size=".0008" fromto="{1e-3 * x0:g} {1e-3 * y0:g} 0 {1e-3 * x1:g} {1e-3 * y1:g} 0"/>'
        for x0, y0, x1, y1 in bars
    )
    where = f"a figure of {len(bars)} round bars, {aside * 1e9:g} nm aside"
    return Case(where, on_slide(capsules, 9e-4, at=(aside, 0)), 0.1, mirrors="x")


_CROSS = ((-4, 0, 4, 0), (0, -4, 0, 4))
_HASH = ((-5, 1.5, 5, 1.5), (-5, -1.5, 5, -1.5), (1.5, -5, 1.5, 5), (-1.5, -5, -1.5, 5))


def _edge(grams: float) -> Case:
    edge = '<geom type="box" size=".003 .003 .003"/>'
    height = 3e-3 * np.sqrt(2) + 1e-4
    return Case(
        f"an edge of 6 mm under {grams:g} gf", on_slide(edge, height, turn='euler="45 0 0"'), grams * GF, mirrors="xy"
    )


def _lying_capsule(turn: float) -> Case:
    geom = '<geom type="capsule" size=".0025 .003" quat=".70710678118654752 0 .70710678118654752 0"/>'
    return Case(
        f"a lying capsule, turned by {turn:g} degrees about the pad's normal",
        on_slide(geom, 2.6e-3, at=(1.1e-3, 0.4e-3) if turn == 0 else (-0.4e-3, 1.1e-3), turn=f'euler="0 0 {turn:g}"'),
        0.5,
    )


def _ball_and(other: str, about: str) -> Case:
    return Case(about, on_slide(f'<geom type="sphere" size=".004"/>{other}', 4.1e-3), 0.4, mirrors="xy")


_GHOST = 'contype="0" conaffinity="0"'


def _plate_at(height: float) -> Case:
    """`height` [m] of the plate's lower side above the lowest point of the ball."""
    plate = f'<geom type="box" size=".006 .006 .0005" pos="0 0 {height + 0.5e-3 - 4e-3:.9g}" {_GHOST}/>'
    return _ball_and(plate, f"a ball with a plate that does not collide, {height * 1e3:g} mm above the pad")


def _grip(yaw: float, roll: float) -> Case:
    """A fixed cube between two fingers with pads, which press on it with 10 N each along x."""
    quarter = 'quat=".70710678118654752 0 .70710678118654752 0"'
    other = 'quat=".70710678118654752 0 -.70710678118654752 0"'
    inertia = '<inertial pos="0 0 0" mass=".05" diaginertia="1e-5 1e-5 1e-5"/>'
    cube = f'<body euler="0 {roll:g} {yaw:g}"><geom name="cube" type="box" size=".02 .02 .02"/></body>'
    left = (
        f'<body name="left" pos="-.0222 0 0" {quarter}><joint name="press" type="slide" axis="0 0 -1" damping="10"/>'
        f"{inertia}{{pad}}</body>"
    )
    right = (
        f'<body name="right" pos=".0222 0 0" {other}><joint name="press2" type="slide" axis="0 0 -1" damping="10"/>'
        f'{inertia}<geom name="pad2" type="box" size=".0075 .0075 .0025" pos="0 0 -.0025" {CONTACT}/></body>'
    )
    equal = f"a cube gripped by two pads, yaw {yaw:g}, roll {roll:g} degrees"
    return Case(equal, cube + right, 10.0, pad_body=left)


def _grow(model: mujoco.MjModel) -> None:
    model.geom("ball").size = (8e-3, 0, 0)
    model.geom_rbound[model.geom("ball").id] = 8e-3
    model.body_pos[model.body("body").parentid[0], 2] = 8.1e-3


def _hills(first: bool) -> np.ndarray:
    """Elevations from 0 to 1: a hill in the middle of a slope, or a wider one beside it."""
    x, y = np.meshgrid(np.linspace(-1, 1, 21), np.linspace(-1, 1, 21))
    if not first:
        x, y = x - 0.3, y + 0.15
    hill = np.exp(-(x**2 + y**2) / (0.08 if first else 0.3)) + 0.1 * x
    return (hill - hill.min()) / np.ptp(hill)


def _new_hills(model: mujoco.MjModel) -> None:
    # The file's first row is the last in memory.
    model.hfield_data[:] = np.flipud(_hills(False)).astype(np.float32).ravel()


def _hfield(data: np.ndarray) -> str:
    return (
        f'<hfield name="hills" nrow="{data.shape[0]}" ncol="{data.shape[1]}" size=".012 .012 .002 .001" '
        f'elevation="{" ".join(f"{v:.9g}" for v in data.ravel())}"/>'
    )


_HILLS = '<geom type="hfield" hfield="hills" pos="0 0 -.002"/>'
_ON_THE_FLOOR = '<geom type="plane" size="1 1 .1"/>'


def _flat_box(size: tuple[float, float, float]) -> Case:
    about = "a flat box of 16 x 12 mm, centred on a sheet of {:g} x {:g} x {:g} mm"
    box = '<geom type="box" size=".008 .006 .01"/>'
    return Case(about.format(*(1e3 * s for s in size)), on_slide(box, 0.0101), 3.0, pad=size, mirrors="xy")


def _free(geoms: str, pose: tuple[float, ...], about: str, **options: Any) -> Case:
    """A free body of 100 g at a pose (x, y, z, quaternion) [m], with the velocity of `options`."""
    pos, quat = (" ".join(f"{v:.17g}" for v in part) for part in (pose[:3], pose[3:]))
    body = (
        f'<body name="body" pos="{pos}" quat="{quat}"><freejoint/>'
        f'<inertial pos="0 0 0" mass=".1" diaginertia="4e-5 4e-5 4e-5"/>{geoms}</body>'
    )
    return Case(about, body, **options)


CODE_BLOCK_POSE = (
    0.034005298185031764, 0.02061084860808685, 0.02416602255227295,
    0.12931271100542802, -0.0823161700539984, -0.11986454814504234, 0.980884682833845,
)  # fmt: skip
_UPRIGHT = (1.0, 0.0, 0.0, 0.0)

CASES: dict[str, Case] = {
    # A body at a pad's rim, or beside it.
    "box at the rim": _free(
        '<geom type="box" size=".025 .025 .025"/>', CODE_BLOCK_POSE, "a corner of a cube inside the pad's side"
    ),
    "box nudges the rim": _free(
        '<geom type="box" size=".005 .005 .005"/>',
        (0.0126, 0.0, -0.0035, *_UPRIGHT),
        "a box pushed against a pad's side, its top above the rim",
        steps=200,
        velocity=(-0.4, 0, 0.02, 0, 0.5, 0),
    ),
    "cylinder nudges the rim": _free(
        '<geom type="cylinder" size=".004 .006"/>',
        (0.0117, 0.002, -0.004, 0.9659, 0.2, 0.1, 0.1),
        "a cylinder pushed against a pad's side, leaning",
        steps=200,
        velocity=(-0.4, 0, 0.02, 0, 0.5, 0),
    ),
    "box over the rim": Case(
        "a box half beside the pad", on_slide('<geom type="box" size=".005 .004 .005"/>', 5.1e-3, at=(7e-3, 0)), 1.0
    ),
    "box from beside": Case(
        "a wall pressed against the pad's side, as high as its rim",
        '<geom type="box" size=".003 .02 .02" pos=".0107 0 -.02"/>',
        2.0,
        pad_body='<body name="finger"><joint name="press" type="slide" axis="-1 0 0" damping="10"/>'
        '<inertial pos="0 0 0" mass=".05" diaginertia="1e-5 1e-5 1e-5"/>{pad}</body>',
    ),
    # Wide and thin pads.
    "22 x 37 x 3 mm": _flat_box((22e-3, 37e-3, 3e-3)),
    "20 x 20 x 3 mm": _flat_box((20e-3, 20e-3, 3e-3)),
    "15 x 15 x 5 mm": _flat_box((15e-3, 15e-3, 5e-3)),
    "60 x 40 x 5 mm": _flat_box((60e-3, 40e-3, 5e-3)),
    "cone on 1 mm": Case(
        "the point of a cone on a pad of 1 mm",
        on_slide('<geom type="mesh" mesh="cone"/>', 1e-4),
        0.3,
        assets=meshes.mjcf("cone", meshes.cone(4e-3, 6e-3)),
        pad=(15e-3, 15e-3, 1e-3),
        mirrors="xy",
    ),
    "plane on a narrow pad": _falling_pad(
        _ON_THE_FLOOR, about="a plane under a pad of 30 x 6 x 3 mm", force=3.0, pad=(30e-3, 6e-3, 3e-3), mirrors="xy"
    ),
    "cylinder on a small pad": Case(
        "an upright cylinder of 3 mm diameter on a pad of 4 x 4 x 2 mm",
        on_slide('<geom type="cylinder" size=".0015 .004"/>', 4.1e-3),
        0.3,
        pad=(4e-3, 4e-3, 2e-3),
    ),
    # Readings that cannot be.
    **{f"grip, yaw {yaw:g}": _grip(yaw, 0.0) for yaw in (0.0, 1.0, 3.0, 5.0)},
    "grip by a corner": _grip(3.0, 0.7),
    "torus of another plugin": Case(
        "a signed distance function of MuJoCo's own plugin",
        on_slide('<geom type="sdf" mesh="sdf"><plugin instance="sdf"/></geom>', 1.6e-3),
        0.5,
        assets='<mesh name="sdf"><plugin instance="sdf"/></mesh>',
        extensions='<plugin plugin="mujoco.sdf.torus"><instance name="sdf"><config key="radius1" value=".004"/>'
        '<config key="radius2" value=".0015"/></instance></plugin>',
    ),
    "asleep": _free(
        '<geom type="box" size=".004 .004 .005"/>',
        (0.0, 0.0, 0.005, *_UPRIGHT),
        "a box that falls asleep on the pad",
        sleep=True,
        steps=3000,
        mirrors="xy",
    ),
    "geoms of one body": Case(
        "a box and a ball of one body, of different heights, under law foundation",
        on_slide(
            '<geom type="box" size=".002 .003 .002" pos="-.003 0 .002"/>'
            '<geom type="sphere" size=".002" pos=".003 0 .00202"/>',
            1e-4,
        ),
        0.8,
        law="foundation",
    ),
    "two bodies": Case(
        "two balls, each a body, 4.4 mm apart",
        on_slide('<geom type="sphere" size=".002"/>', 2.1e-3, at=(-2.2e-3, 0))
        + on_slide('<geom type="sphere" size=".002"/>', 2.1e-3, at=(2.2e-3, 0), number="2"),
        0.4,
        mirrors="xy",
    ),
    # Several places at once, rings, lines.
    "torus mesh": _ring(3.5e-3, 1.2e-3, 0.6, mirrors="xy"),
    "torus mesh, 2 um aside": _ring(3.5e-3, 1.2e-3, 0.6, aside=2e-6, mirrors="y"),
    # MuJoCo touches it at four of its corners, which are not opposite each other.
    "O-ring": _ring(5e-3, 0.5e-3, 0.5, sections=(48, 16)),
    "O-ring across the sheet's end": _ring(7e-3, 2.5e-3, 1.0, aside=1e-3, across=0.6e-3, sections=(64, 24)),
    "cross of bars": _bars(_CROSS),
    "cross of bars, 1 nm aside": _bars(_CROSS, aside=1e-9),
    "hash of bars": _bars(_HASH),
    "hash of bars, 1 nm aside": _bars(_HASH, aside=1e-9),
    "wide ring": _ring(6e-3, 2e-3, 0.5, sections=(96, 32), mirrors="xy"),
    **{f"ring of {1e3 * force:g} mN": _ring(4e-3, 1e-3, force, mirrors="xy") for force in (0.02, 0.1, 0.5, 2.0)},
    "notched bar": _notched(),
    "two rods": _rods(2),
    "four rods": _rods(4),
    "two balls": Case(
        "two balls of one body",
        on_slide(
            '<geom type="sphere" size=".003" pos="-.0035 0 0"/><geom type="sphere" size=".003" pos=".0035 0 0"/>',
            3.1e-3,
        ),
        0.5,
        mirrors="xy",
    ),
    **{f"{count} feet": _feet(count) for count in range(2, 7)},
    "25 feet": _grid_of_feet(5),
    "square below a plate": Case(
        "a square, and 60 um above it a plate that comes down as well",
        on_slide(
            '<geom type="box" size=".0018 .0018 .001"/><geom type="box" size=".0045 .0045 .001" pos="0 0 .00006"/>',
            1.1e-3,
        ),
        2.8,
        mirrors="xy",
    ),
    "balls below a plate": Case(
        "a plate from which two balls stand out by 30 and 65 um",
        on_slide(
            '<geom type="box" size=".0045 .004 .001"/>'
            '<geom type="sphere" size=".00055" pos="-.0017 .0031 -.00048"/>'
            '<geom type="sphere" size=".0013" pos=".0018 -.0022 .000235"/>',
            1.1e-3,
        ),
        0.35,
    ),
    "frame": Case(
        "a square frame of four boxes, 10 mm wide, its bars 1 mm",
        on_slide(
            "".join(
                f'<geom type="box" size="{long} {wide} .002" pos="{x} {y} .002"/>'
                for long, wide, x, y in (
                    (0.005, 0.0005, 0, 0.0045),
                    (0.005, 0.0005, 0, -0.0045),
                    (0.0005, 0.004, 0.0045, 0),
                    (0.0005, 0.004, -0.0045, 0),
                )
            ),
            1e-4,
        ),
        1.0,
        mirrors="xy",
    ),
    "star": Case(
        "a star-shaped prism, a mesh with notches",
        on_slide('<geom type="mesh" mesh="star"/>', 1e-4),
        1.0,
        assets=meshes.mjcf("star", meshes.star(5e-3, 2e-3, 4e-3)),
    ),
    **{f"edge, {grams:g} gf": _edge(grams) for grams in (1.5, 3.0, 6.0)},
    "capsule": _lying_capsule(0.0),
    "capsule, turned": _lying_capsule(90.0),
    # Which geoms press.
    "ball": _ball_and("", "a ball alone"),
    **{f"ball under a plate, {h * 1e3:g} mm": _plate_at(h) for h in (5e-3, 20e-3, 200e-3)},
    "ball over a plate": _ball_and(
        f'<geom type="box" size=".006 .006 .0005" pos="0 0 -.012" {_GHOST}/>',
        "a ball with a plate that does not collide, below the pad's foot",
    ),
    "ball with a halo": _ball_and(f'<geom type="sphere" size=".006" {_GHOST}/>', "a ball within a halo"),
    "ball with a marker": _ball_and(
        '<geom type="capsule" size=".0003 .005" pos=".003 0 -.0035" quat=".70710678118654752 0 .70710678118654752 0" '
        f"{_GHOST}/>",
        "a ball with a marker line that does not collide, just above the pad",
    ),
    "box above its origin": Case(
        "a box whose bottom is 3.5 mm above its body's origin, leaning by 1.5 degrees",
        on_slide('<geom type="box" size=".003 .003 .004" pos="0 0 .0075"/>', -3.3e-3, turn='euler="1.5 0 0"'),
        1.0,
        mirrors="x",
    ),
    "box around its origin": Case(
        "the same box around its origin",
        on_slide(
            '<geom type="box" size=".003 .003 .004"/>',
            -3.3e-3 + 7.5e-3 * np.cos(np.radians(1.5)),
            at=(0, -7.5e-3 * np.sin(np.radians(1.5))),
            turn='euler="1.5 0 0"',
        ),
        1.0,
        mirrors="x",
    ),
    # Models that change while they run, each with what they become.
    "size changed": Case(
        "a ball of 4 mm radius that becomes one of 8 mm",
        on_slide('<geom name="ball" type="sphere" size=".004"/>', 4.1e-3),
        0.6,
        change=_grow,
        mirrors="xy",
    ),
    "size as changed": Case(
        "a ball of 8 mm radius", on_slide('<geom name="ball" type="sphere" size=".008"/>', 8.1e-3), 0.6, mirrors="xy"
    ),
    "height field changed": _falling_pad(
        _HILLS, about="a hill that becomes another one", force=0.8, assets=_hfield(_hills(True)), change=_new_hills
    ),
    "height field as changed": _falling_pad(_HILLS, about="the other hill", force=0.8, assets=_hfield(_hills(False))),
}
