"""Random scenes around pads, as values drawn from seeds, and as MJCF.

A scene says where pads and bodies are, so that it can be turned and mirrored (invariants.py) and reported whole
(soak.py). Lengths are metres, masses kilograms, forces newtons.
"""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from pathlib import Path
from xml.etree import ElementTree
from xml.sax.saxutils import quoteattr

import meshes
import mujoco
import numpy as np

import mjtactile
from mjtactile._types import Array
from mjtactile.fidelity import PRESETS, fidelity_text
from mjtactile.influence.provenance import influence_fingerprint
from mjtactile.pad_shape.surfaces import CylinderSector, EllipsoidCap, SphereCap, Surface
from mjtactile.plugin.attributes import OUTPUTS
from mjtactile.sim.mjcf import add_pad_meshes, mesh_geoms
from mjtactile.sim.pad_geom import contact_attributes

ROOT = Path(__file__).resolve().parents[2]
#: Contact of a pad as attach_pad makes it.
_CONTACT = " ".join(f'{name}="{value}"' for name, value in contact_attributes("stiff").items())
#: What every sensor puts out, and how many numbers that is; those that this version does not know are left out.
WIDTHS = {"wrench": 6, "carried": 6, "range": 1}
ASKED = ("von_mises", *(name for name in WIDTHS if name in OUTPUTS))
_PDMS = (3e6, 0.49)
#: Older versions of MuJoCo never let bodies fall asleep.
_CAN_SLEEP = hasattr(mujoco.mjtEnableBit, "mjENBL_SLEEP")
_MIRROR = np.diag([-1.0, 1.0, 1.0])


@dataclass(frozen=True)
class PadKind:
    """A pad of the soak: its value, and the presets that scenes ask for on it."""

    pad: mjtactile.Pad
    fidelities: tuple[str, ...] = ("fast", "balanced")


def _pad(length: float, width: float, *layers: tuple[float, float, float]) -> mjtactile.Pad:
    """A pad of a size [mm] and layers of (thickness [mm], Young's modulus [Pa], Poisson's ratio), two depths felt."""
    thickness = 1e-3 * sum(layer[0] for layer in layers)
    length, width = length * 1e-3, width * 1e-3
    columns, rows = (max(3, min(13, round(side / 1.2e-3))) for side in (length, width))
    return mjtactile.Pad(
        size=(length, width),
        layers=tuple(mjtactile.Layer(thickness=h * 1e-3, young=e, poisson=nu) for h, e, nu in layers),
        taxels=mjtactile.TaxelGrid(rows=rows, columns=columns, pitch=(length / (columns + 1), width / (rows + 1))),
        depths=(thickness / 4, 3 * thickness / 4),
        sampling_radius=min(0.625e-3, thickness / 8, length / 16, width / 16),
    )


def _plain(length: float, width: float, thickness: float) -> mjtactile.Pad:
    return _pad(length, width, (thickness, *_PDMS))


def _bent(length: float, width: float, thickness: float, surface: Surface) -> mjtactile.Pad:
    return dataclasses.replace(_plain(length, width, thickness), surface=surface)


#: Pads by name. Tables of the first ones are built within seconds.
PADS = {
    "15x15x5": PadKind(mjtactile.Pad()),
    "4x4x1": PadKind(_plain(4, 4, 1)),
    "6x6x4": PadKind(_plain(6, 6, 4)),
    "10x12x5": PadKind(_plain(10, 12, 5)),
    "12x12x4 of three layers": PadKind(_pad(12, 12, (1, 1e6, 0.49), (1, 4e6, 0.3), (2, 2e6, 0.45))),
    "20x20x20": PadKind(_plain(20, 20, 20)),
    "30x6x3": PadKind(_plain(30, 6, 3)),
    "60x40x10": PadKind(_plain(60, 40, 10)),
    "22x37x3": PadKind(_plain(22, 37, 3), ("fast",)),
    "dome of 12 mm": PadKind(_bent(13, 13, 4, SphereCap(12e-3))),
    "fingertip of 8 mm": PadKind(_bent(12, 18, 3, CylinderSector(8e-3))),
    "egg": PadKind(_bent(9, 12, 2, EllipsoidCap((9e-3, 13e-3, 7e-3)))),
}
#: Pads whose tables take no time to speak of.
QUICK_PADS = tuple(PADS)[:5]
#: Fingertips: theirs take a quarter of a minute each.
CURVED_PADS = ("dome of 12 mm", "fingertip of 8 mm", "egg")
FLAT_PADS = tuple(name for name in PADS if name not in CURVED_PADS)


@dataclass(frozen=True)
class Geom:
    """A geom in its body's frame."""

    kind: str  #: what it is called in reports
    type: str  #: as MuJoCo calls it
    size: tuple[float, ...] = ()
    pos: Array = field(default_factory=lambda: np.zeros(3))
    rotation: Array = field(default_factory=lambda: np.eye(3))
    mesh: meshes.Mesh | None = None
    is_open: bool = False  #: whether the mesh has a rim
    sdf: str = ""  #: name and config of another plugin's signed distance function
    collides: bool = True
    mass: float = 0.0


@dataclass(frozen=True)
class Body:
    """A rigid body in its pad's frame."""

    geoms: tuple[Geom, ...]
    pos: Array
    rotation: Array
    joint: str = "free"  #: "free", "slide" along the pad's z, or "" for what is fixed
    velocity: tuple[float, ...] = ()
    target: tuple[float, float] = (0.0, 0.0)  #: point of the pad to which it is pushed
    force: float = 0.0  #: with which it is pushed


@dataclass(frozen=True)
class PlacedPad:
    """A pad in the world, and what is asked of it."""

    kind: str  #: key of PADS
    fidelity: str = "fast"
    config: tuple[tuple[str, str], ...] = ()  #: further attributes
    pos: Array = field(default_factory=lambda: np.zeros(3))
    rotation: Array = field(default_factory=lambda: np.eye(3))
    moves: bool = False  #: on a slide along its z, pushed along it
    force: float = 0.0

    @property
    def pad(self) -> mjtactile.Pad:
        """Its value."""
        return PADS[self.kind].pad


@dataclass(frozen=True)
class Scene:
    """Pads and the bodies that press on each."""

    seed: int
    story: str  #: what happens
    pads: tuple[PlacedPad, ...]
    bodies: tuple[tuple[Body, ...], ...]  #: by pad
    timestep: float = 1e-3
    option: str = 'integrator="implicitfast" cone="elliptic"'  #: further attributes of MJCF's option
    sleep: bool = False
    gravity: float = -9.81
    floor: bool = False  #: a plane at the foot of the first pad
    changes: tuple[str, ...] = ()  #: what is changed at run time: "size", "friction", "mass", "hfield"

    @property
    def kinds(self) -> str:
        """Kinds of all geoms that collide."""
        return ", ".join(sorted({g.kind for bodies in self.bodies for b in bodies for g in b.geoms if g.collides}))


# ----------------------------------------------------------------------------------------------------- tables


def prepare(names: Iterable[str], folder: Path, precision: str | None = None) -> None:
    """Build tables of pads in every fidelity that scenes ask for, and make the pads known. Seconds to minutes, once.

    Args:
        names: of the pads.
        folder: where files of tables are kept.
        precision: of the tables, all of them of the mesh "draft" then; None for what each fidelity stores.
    """
    folder.mkdir(parents=True, exist_ok=True)
    _folder[0], _precision[0] = folder, precision
    _attributes.cache_clear()
    for name in names:
        for fidelity in PADS[name].fidelities:
            _attributes(name, fidelity)


_folder = [ROOT / "build" / "soak" / "pads"]
_precision: list[str | None] = [None]


@functools.cache
def _attributes(name: str, fidelity: str) -> dict[str, str]:
    """Attributes "pad" and "fidelity" of a sensor on a pad.

    The default pad is asked for by presets. Others are registered for "fast"; for "balanced" they come as files, which
    hold balanced tables of the mesh "draft": the preset's own mesh takes minutes.
    """
    pad, precision = PADS[name].pad, _precision[0]
    standard, known = pad == mjtactile.Pad(), "soak-" + name.replace(" ", "-")
    chosen = dataclasses.replace(PRESETS[fidelity], mesh="draft")
    if precision is not None or standard or fidelity == "fast":
        if not standard:
            mjtactile.register_pad(known, pad)
        exact = dataclasses.replace(chosen, precision=precision) if precision else PRESETS[fidelity]
        mjtactile.influence_matrices(pad, fidelity=exact)  # or each scene would, and say so
        return {"pad": "default" if standard else known, "fidelity": fidelity_text(exact) if precision else fidelity}
    path = _folder[0] / f"{known}-{influence_fingerprint(pad, chosen)[:12]}.safetensors"
    influence = mjtactile.influence_matrices(pad, fidelity=chosen)
    if not path.is_file():
        influence.save(path)
    return {"pad": str(path)}


# ------------------------------------------------------------------------------------------------------- MJCF


def mjcf(scene: Scene) -> str:
    """The scene as MJCF. Pads are geoms "pad0", "pad1", ..., their sensors "touch0", "touch1", ..."""
    assets: list[str] = []
    extensions = ['<plugin plugin="mjtactile.pad"/>']
    world, sensors = [], []
    for number, (pad, bodies) in enumerate(zip(scene.pads, scene.bodies, strict=True)):
        geom = _pad_geom(pad.pad, f"pad{number}", assets)
        joint = f'<joint name="finger{number}" type="slide" axis="0 0 1" damping="2"/>' if pad.moves else ""
        inertia = '<inertial pos="0 0 0" mass=".05" diaginertia="1e-5 1e-5 1e-5"/>' if pad.moves else ""
        world.append(f'<body name="holder{number}" {_pose(pad.pos, pad.rotation)}>{joint}{inertia}{geom}</body>')
        for index, body in enumerate(bodies):
            name = f"body{number}-{index}"
            inner = "".join(_geom(g, f"{name}-{k}", assets, extensions) for k, g in enumerate(body.geoms))
            world.append(_body(name, body, pad, inner))
        config = _attributes(pad.kind, pad.fidelity) | {"output": " ".join(ASKED)} | dict(pad.config)
        keys = "".join(f'<config key="{key}" value={quoteattr(value)}/>' for key, value in config.items())
        sensors.append(
            f'<plugin name="touch{number}" plugin="mjtactile.pad" objtype="geom" objname="pad{number}">{keys}</plugin>'
        )
    if scene.floor:
        foot = scene.pads[0].pos[2] - scene.pads[0].pad.thickness
        world.append(f'<geom name="floor" type="plane" size="2 2 .1" pos="0 0 {foot:.17g}"/>')
    return f"""<mujoco model="soak {scene.seed}">
  <compiler boundmass="1e-4" boundinertia="1e-8" balanceinertia="true"/>
  <option timestep="{scene.timestep:.9g}" gravity="0 0 {scene.gravity:g}" jacobian="dense" {scene.option}>
    {'<flag sleep="enable"/>' if scene.sleep and _CAN_SLEEP else ""}</option>
  <extension>{"".join(extensions)}</extension>
  <asset>{"".join(assets)}</asset>
  <worldbody>{"".join(world)}</worldbody>
  <sensor>{"".join(sensors)}</sensor>
</mujoco>"""


def _pad_geom(pad: mjtactile.Pad, name: str, assets: list[str]) -> str:
    if pad.surface.is_flat:
        half = (*(side / 2 for side in pad.size), pad.thickness / 2)
        shapes = [f'name="{name}" type="box" size="{_text(half)}" pos="0 0 {-half[2]:.17g}"']
    else:
        root = ElementTree.Element("mujoco")
        add_pad_meshes(root, pad, name)
        assets += [ElementTree.tostring(mesh, encoding="unicode") for mesh in root.iter("mesh")]
        shapes = [" ".join(f'{key}="{value}"' for key, value in one.items()) for one in mesh_geoms(pad, name, name)]
    return "".join(f'<geom {shape} {_CONTACT} density="965"/>' for shape in shapes)


def _body(name: str, body: Body, pad: PlacedPad, geoms: str) -> str:
    turn = pad.rotation @ body.rotation
    pos = pad.pos + pad.rotation @ body.pos
    if body.joint == "slide":
        axis = _text(pad.rotation[:, 2])
        joint = f'<joint name="{name}" type="slide" axis="{axis}" damping="10"/>'
        return (
            f'<body {_pose(pos, np.eye(3))}>{joint}<body name="{name}" {_pose(np.zeros(3), turn)}>{geoms}</body></body>'
        )
    return f'<body name="{name}" {_pose(pos, turn)}>{f"<freejoint name={name!r}/>" if body.joint else ""}{geoms}</body>'


def _geom(geom: Geom, name: str, assets: list[str], extensions: list[str]) -> str:
    attributes = f'name="{name}" type="{geom.type}" {_pose(geom.pos, geom.rotation)} mass="{geom.mass:.9g}" '
    attributes += "" if geom.collides else 'contype="0" conaffinity="0" '
    if geom.type == "hfield":
        assert geom.mesh is not None
        heights = geom.mesh[0]
        assets.append(
            f'<hfield name="{name}" nrow="{heights.shape[0]}" ncol="{heights.shape[1]}" size="{_text(geom.size)}" '
            f'elevation="{_text(np.flipud(heights).ravel())}"/>'
        )
        return f'<geom {attributes} hfield="{name}"/>'
    if geom.type == "sdf":
        plugin, _, config = geom.sdf.partition(" ")
        extensions.append(f'<plugin plugin="{plugin}"><instance name="{name}">{config}</instance></plugin>')
        assets.append(f'<mesh name="{name}"><plugin instance="{name}"/></mesh>')
        return f'<geom {attributes} mesh="{name}"><plugin instance="{name}"/></geom>'
    if geom.mesh is not None:
        assets.append(meshes.mjcf(name, geom.mesh, "shell" if geom.is_open else "convex"))
        return f'<geom {attributes} mesh="{name}"/>'
    return f'<geom {attributes} size="{_text(geom.size)}"/>'


def _pose(pos: Array, rotation: Array) -> str:
    quat = np.empty(4)
    mujoco.mju_mat2Quat(quat, np.ascontiguousarray(rotation).ravel())
    return f'pos="{_text(pos)}" quat="{_text(quat)}"'


def _text(numbers: Iterable[float]) -> str:
    return " ".join(f"{number:.17g}" for number in numbers)


# ------------------------------------------------------------------------------------------------ turned, mirrored


def turned(scene: Scene, rotation: Array) -> Scene:
    """The scene with all bodies turned about the pads' origins, in the pads' frames; the pads stay."""
    return _with_bodies(
        scene, lambda body: dataclasses.replace(body, pos=rotation @ body.pos, rotation=rotation @ body.rotation)
    )


def mirrored(scene: Scene) -> Scene:
    """The scene with all bodies mirrored in the pads' frames, x -> -x. Signed distance functions cannot be."""
    return _with_bodies(
        scene,
        lambda body: dataclasses.replace(
            body,
            pos=_MIRROR @ body.pos,
            rotation=_MIRROR @ body.rotation @ _MIRROR,
            geoms=tuple(_mirrored(geom) for geom in body.geoms),
        ),
    )


def _mirrored(geom: Geom) -> Geom:
    mesh = geom.mesh
    if geom.type == "hfield" and mesh is not None:
        mesh = np.fliplr(mesh[0]), mesh[1]
    elif mesh is not None:
        mesh = mesh[0] @ _MIRROR, mesh[1][:, ::-1]
    return dataclasses.replace(geom, pos=_MIRROR @ geom.pos, rotation=_MIRROR @ geom.rotation @ _MIRROR, mesh=mesh)


def elsewhere(scene: Scene, pos: Array, rotation: Array) -> Scene:
    """The scene moved as a whole, pads and bodies."""
    pads = (dataclasses.replace(p, pos=pos + rotation @ p.pos, rotation=rotation @ p.rotation) for p in scene.pads)
    return dataclasses.replace(scene, pads=tuple(pads))


def _with_bodies(scene: Scene, change: Callable[[Body], Body]) -> Scene:
    return dataclasses.replace(scene, bodies=tuple(tuple(map(change, bodies)) for bodies in scene.bodies))


# ------------------------------------------------------------------------------------------------------- drawing


def scene(seed: int, pads: Iterable[str] = tuple(PADS)) -> Scene:
    """A scene that moves: bodies dropped on pads, pushed over them and against their sides, pads pressed on things.

    Args:
        seed: the same seed gives the same scene.
        pads: names of the pads to choose from.
    """
    rng = np.random.default_rng((seed, 13))
    story = str(rng.choice(list(_STORIES), p=[0.2, 0.2, 0.15, 0.15, 0.15, 0.15]))
    count = 1 if story in ("finger", "grip") else int(rng.choice([1, 1, 1, 2, 3]))
    placed, bodies = [], []
    for number in range(count):
        pad = _placed(rng, tuple(pads), number)
        if story == "grip":
            across = float(rng.uniform(0.002, 0.04))
            finger, gripped = _grip(rng, pad, across)
            placed += [finger, dataclasses.replace(_other_finger(pad, across), force=finger.force)]
            bodies += [gripped, ()]
            continue
        pad, around = _STORIES[story](rng, pad)
        placed.append(pad)
        bodies.append(around)
    changes = tuple(str(c) for c in ("size", "friction", "mass", "hfield") if rng.random() < 0.12)
    timestep = 0.1 if rng.random() < 0.03 else float(np.exp(rng.uniform(np.log(5e-4), np.log(1e-2))))
    choices = {
        "integrator": ["Euler", "implicit", "implicitfast"],
        "cone": ["elliptic", "pyramidal"],
        "solver": ["Newton", "Newton", "Newton", "CG"],
        "iterations": [20, 100],
        "impratio": [1, 100],
        "noslip_iterations": [0, 4],
    }
    option = " ".join(f'{name}="{rng.choice(values)}"' for name, values in choices.items())
    return Scene(
        seed, story, tuple(placed), tuple(bodies), timestep, option, bool(rng.random() < 0.1),
        floor=story != "finger" and bool(rng.random() < 0.5), changes=changes,
    )  # fmt: skip


def still_scene(seed: int, pads: Iterable[str] = tuple(PADS), flat: bool = False) -> Scene:
    """One pad and one or two bodies on slides above it, each pressed with its force, to be brought to rest.

    Args:
        seed: the same seed gives the same scene.
        pads: names of the pads to choose from.
        flat: whether bodies lie on flat faces.
    """
    rng = np.random.default_rng((seed, 31))
    pad = dataclasses.replace(_placed(rng, tuple(pads), 0), pos=np.zeros(3), rotation=np.eye(3), moves=False)
    if flat:
        pad = dataclasses.replace(pad, config=(("law", "elastic"),))
    bodies = []
    for index in range(1 if flat else int(rng.choice([1, 1, 1, 2]))):
        size = _half_size(rng, pad) * (0.6 if index else 1.0)
        geoms = (_upright(rng, size),) if flat else _geoms(rng, size, still=True)
        rotation = _about_z(rng.uniform(0, 2 * np.pi)) @ (np.eye(3) if flat else _any_pose(rng))
        middle = rng.uniform(-0.3, 0.3, 2) * pad.pad.size if index == 0 else rng.uniform(-0.5, 0.5, 2) * pad.pad.size
        body = Body(geoms, np.zeros(3), rotation, "slide", force=_force(rng, pad))
        bodies.append(dataclasses.replace(body, pos=np.array([*middle, 1e-4 - _lowest(body)])))
    return Scene(
        seed, "still", (pad,), (tuple(bodies),), gravity=0.0,
        option='integrator="implicitfast" cone="elliptic" tolerance="1e-14" iterations="200" ls_iterations="100"',
    )  # fmt: skip


def _placed(rng: np.random.Generator, names: tuple[str, ...], number: int) -> PlacedPad:
    kind = str(rng.choice(names))
    fidelity = str(rng.choice(PADS[kind].fidelities))
    config: dict[str, str] = {}
    if rng.random() < 0.4:
        config["law"] = str(rng.choice(["elastic", "foundation", "uniform"]))
    if rng.random() < 0.3:
        config["tangential"] = str(rng.choice(["proportional", "stick", "coulomb"]))
        if config["tangential"] == "coulomb":
            config["friction"] = f"{rng.uniform(0.1, 1.5):.3g}"
        if config["tangential"] != "proportional":
            config["law"] = "elastic"
    elif rng.random() < 0.2:
        config["friction"] = f"{rng.uniform(0.1, 1.5):.3g}"
    if rng.random() < 0.2:
        config["tilt"] = "fixed"
    rotation = np.eye(3) if rng.random() < 0.6 else _about_z(rng.uniform(0, 6.3)) @ _leaning(rng, rng.choice([5, 40]))
    pos = np.array([0.3 * number, 0.0, PADS[kind].pad.thickness])
    return PlacedPad(kind, fidelity, tuple(config.items()), pos, rotation)


def _half_size(rng: np.random.Generator, pad: PlacedPad) -> float:
    """Half a body's extent [m]: from a tenth of the pad to three times the pad."""
    return min(pad.pad.size) / 2 * float(np.exp(rng.uniform(np.log(0.12), np.log(2.0))))


def _force(rng: np.random.Generator, pad: PlacedPad) -> float:
    """A pressing force [N]: what a finger does, less on small pads."""
    area = float(np.prod(pad.pad.size))
    return float(np.exp(rng.uniform(np.log(0.02), np.log(20.0)))) * min(1.0, area / 2.25e-4)


def _dropped(rng: np.random.Generator, pad: PlacedPad) -> tuple[PlacedPad, tuple[Body, ...]]:
    """Bodies fall on the pad as they come, some of them flat."""
    bodies = []
    top = 0.0
    for _ in range(int(rng.choice([1, 1, 2, 3]))):
        body = _a_body(rng, pad)
        middle = rng.uniform(-0.5, 0.5, 2) * pad.pad.size
        lowest = _lowest(body)
        bodies.append(dataclasses.replace(body, pos=np.array([*middle, top + 5e-4 - lowest])))
        top += 5e-4 - lowest + _highest(body)
    return pad, tuple(bodies)


def _pressed(rng: np.random.Generator, pad: PlacedPad) -> tuple[PlacedPad, tuple[Body, ...]]:
    """Bodies are pressed on the pad from above, with forces that wander."""
    _, bodies = _dropped(rng, pad)
    targets = rng.uniform(-0.5, 0.5, (len(bodies), 2)) * pad.pad.size
    return pad, tuple(
        dataclasses.replace(body, force=_force(rng, pad), target=(float(x), float(y)))
        for body, (x, y) in zip(bodies, targets, strict=True)
    )


def _from_beside(rng: np.random.Generator, pad: PlacedPad) -> tuple[PlacedPad, tuple[Body, ...]]:
    """A body is pushed against the pad's sides, about as high as its rim."""
    body = _a_body(rng, pad)
    angle = rng.uniform(0, 2 * np.pi)
    reach = np.hypot(*pad.pad.size) / 2 + _highest(body) + 5e-4
    height = float(rng.uniform(-pad.pad.thickness, 0.3 * _highest(body)))
    away = np.array([np.cos(angle), np.sin(angle), 0])
    pos = reach * away + [0, 0, height]
    speed = -away * rng.uniform(0.05, 1.0)
    return pad, (dataclasses.replace(body, pos=pos, velocity=(*speed, 0, 0, 0), force=_force(rng, pad)),)


def _over_the_rim(rng: np.random.Generator, pad: PlacedPad) -> tuple[PlacedPad, tuple[Body, ...]]:
    """A body is put over a rim or a corner."""
    body = _a_body(rng, pad)
    side = rng.choice([-1, 0, 1], 2) if rng.random() < 0.8 else np.array([1, 1])
    middle = 0.5 * side * pad.pad.size + rng.uniform(-0.1, 0.1, 2) * pad.pad.size
    body = dataclasses.replace(body, pos=np.array([*middle, 2e-4 - _lowest(body)]), target=tuple(middle))
    return pad, (dataclasses.replace(body, force=_force(rng, pad)),)


def _finger(rng: np.random.Generator, pad: PlacedPad) -> tuple[PlacedPad, tuple[Body, ...]]:
    """The pad moves down on what is fixed: a plane, a height field, or bodies."""
    down = np.diag([1.0, -1.0, -1.0])
    above = dataclasses.replace(pad, pos=np.array([0, 0, 0.2]), rotation=down, moves=True, force=_force(rng, pad))
    choice = rng.random()
    if choice < 0.4:
        size = max(pad.pad.size)
        heights = rng.random((9, 9)) if rng.random() < 0.5 else _smooth_heights(rng, int(rng.choice([21, 41])))
        scale = float(rng.uniform(0.05, 0.3) * size)
        geom = Geom("hfield", "hfield", (size, size, scale, 0.1 * size), mesh=(heights, np.empty((0, 3), int)))
        body = Body((geom,), np.array([0, 0, scale * 1.01]), down, "")
    elif choice < 0.6:
        body = Body((Geom("plane", "plane", (1, 1, 0.1)),), np.array([0, 0, 3e-4]), down @ _leaning(rng, 3), "")
    else:
        body = dataclasses.replace(_a_body(rng, pad), joint="")
        middle = rng.uniform(-0.4, 0.4, 2) * pad.pad.size
        body = dataclasses.replace(body, pos=np.array([*middle, 2e-4 - _lowest(body)]))
    return above, (body,)


def _grip(rng: np.random.Generator, pad: PlacedPad, across: float) -> tuple[PlacedPad, tuple[Body, ...]]:
    """One of two fingers, and what they grip: a body of about `across` [m]."""
    finger = dataclasses.replace(
        pad, pos=np.array([-across - 5e-4, 0, 0.1]), rotation=_facing_x(), moves=True, force=_force(rng, pad)
    )
    lean = _leaning(rng, 5) @ _about_z(rng.uniform(-0.1, 0.1))
    box = Geom("box", "box", (across * 0.9, across * rng.uniform(0.3, 2), across * rng.uniform(0.3, 2)), mass=0.05)
    geoms = (box,) if rng.random() < 0.5 else _geoms(rng, across)
    height = across + 5e-4
    return finger, (Body(geoms, np.array([0, 0, height]), _facing_x().T @ lean, "free"),)


def _other_finger(pad: PlacedPad, across: float) -> PlacedPad:
    turn = np.diag([-1.0, -1.0, 1.0]) @ _facing_x()
    return dataclasses.replace(pad, pos=np.array([across + 5e-4, 0, 0.1]), rotation=turn, moves=True)


_STORIES: dict[str, Callable[[np.random.Generator, PlacedPad], tuple[PlacedPad, tuple[Body, ...]]]] = {
    "dropped": _dropped,
    "pressed": _pressed,
    "from beside": _from_beside,
    "over the rim": _over_the_rim,
    "finger": _finger,
    "grip": _dropped,  # placed by `scene` itself: there are two pads
}


def _a_body(rng: np.random.Generator, pad: PlacedPad) -> Body:
    size = _half_size(rng, pad)
    return Body(_geoms(rng, size), np.zeros(3), _any_pose(rng))


def _geoms(rng: np.random.Generator, size: float, still: bool = False) -> tuple[Geom, ...]:
    """Geoms of one body of half an extent `size` [m]."""
    mass = float(np.exp(rng.uniform(np.log(3e-3), np.log(0.3))))
    make = rng.choice(
        ["one", "feet", "rods", "frame", "two", "halo", "marker"], p=[0.6, 0.1, 0.06, 0.06, 0.08, 0.05, 0.05]
    )
    if make == "feet":
        count = int(rng.integers(2, 7))
        foot, kind = 0.25 * size, str(rng.choice(["sphere", "capsule", "cylinder", "box"]))
        angles = 2 * np.pi * np.arange(count) / count
        places = 0.7 * size * np.column_stack([np.cos(angles), np.sin(angles), 0 * angles])
        feet = tuple(_primitive(kind, foot, pos=place, mass=mass / count) for place in places)
        plate = Geom("plate", "cylinder", (size, 0.1 * size), np.array([0, 0, 0.5 * size]), mass=0.1 * mass)
        return (*feet, plate)
    if make == "rods":
        count = int(rng.integers(2, 6))
        lie = _facing_x()
        places = np.linspace(-0.8, 0.8, count) * size
        return tuple(
            Geom("rods", "capsule", (0.12 * size, 0.7 * size), np.array([0, y, 0]), lie, mass=mass / count)
            for y in places
        )
    if make == "frame":
        bar = 0.12 * size
        return tuple(
            Geom(
                "frame",
                "box",
                (a * size + bar, b * size + bar, 0.3 * size),
                np.array([x, y, 0.0]) * size,
                mass=mass / 4,
            )
            for a, b, x, y in ((0.8, 0, 0, 0.8), (0.8, 0, 0, -0.8), (0, 0.8, 0.8, 0), (0, 0.8, -0.8, 0))
        )
    first = _one_geom(rng, size, mass, still)
    if make == "two":
        other = _one_geom(rng, 0.6 * size, 0.3 * mass, still)
        shift = rng.normal(0, 0.7 * size, 3)
        return first, dataclasses.replace(other, pos=shift, rotation=any_rotation(rng))
    if make == "halo":
        return first, Geom("halo", "sphere", (1.5 * size,), collides=False)
    if make == "marker":
        place = np.array([0, 0, rng.uniform(-1, 1) * size])
        return first, Geom("marker", "capsule", (0.05 * size, 1.5 * size), place, _facing_x(), collides=False)
    return (first,)


_PRIMITIVES = ("sphere", "capsule", "cylinder", "box", "ellipsoid")
_MESHES = ("hull", "star", "torus", "cone", "thin plate", "ball mesh", "large mesh", "open mesh", "concave")
_SDFS = {
    "torus": lambda s: {"radius1": 0.7 * s, "radius2": 0.3 * s},
    "bowl": lambda s: {"height": 0.4 * s, "radius": s, "thickness": 0.1 * s},
    "gear": lambda s: {"diameter": 2 * s, "thickness": 0.4 * s, "innerdiameter": 0.4 * s},
}


def _one_geom(rng: np.random.Generator, size: float, mass: float, still: bool) -> Geom:
    choice = rng.random()
    if choice < 0.55:
        return _primitive(str(rng.choice(_PRIMITIVES)), size, rng=rng, mass=mass)
    if choice < 0.95 or still:
        kind = str(rng.choice(_MESHES, p=[0.2, 0.15, 0.15, 0.1, 0.1, 0.1, 0.03, 0.07, 0.1]))
        return Geom(kind, "mesh", mesh=_mesh(rng, kind, size), is_open=kind == "open mesh", mass=mass)
    name = str(rng.choice(list(_SDFS)))
    config = "".join(f'<config key="{key}" value="{value:.6g}"/>' for key, value in _SDFS[name](size).items())
    return Geom("sdf", "sdf", sdf=f"mujoco.sdf.{name} {config}", mass=mass)


def _primitive(
    kind: str, size: float, *, pos: Array | None = None, rng: np.random.Generator | None = None, mass: float
) -> Geom:
    a, b = (1.0, 1.0) if rng is None else (float(v) for v in np.exp(rng.uniform(np.log(0.2), 0.0, 2)))
    sizes = {
        "sphere": (size,),
        "capsule": (size * a, size * b),
        "cylinder": (size * a, size * b),
        "box": (size, size * a, size * b),
        "ellipsoid": (size, size * a, size * b),
    }
    return Geom(kind, kind, sizes[kind], np.zeros(3) if pos is None else pos, mass=mass)


def _mesh(rng: np.random.Generator, kind: str, size: float) -> meshes.Mesh:
    if kind == "hull":
        points = rng.normal(size=(int(rng.integers(6, 40)), 3)) * rng.uniform(0.3, 1.0, 3)
        return meshes.hull(size * points / np.linalg.norm(points, axis=1).max())
    if kind == "star":
        return meshes.star(size, size * rng.uniform(0.3, 0.8), size * rng.uniform(0.1, 1), int(rng.integers(3, 9)))
    if kind == "torus":
        tube = rng.uniform(0.05, 0.4)
        return meshes.torus(size * (1 - tube), size * tube, *(int(n) for n in rng.integers(8, 48, 2)))
    if kind == "cone":
        return meshes.cone(size, size * rng.uniform(0.3, 2), int(rng.integers(5, 48)))
    if kind == "thin plate":
        corners = size * np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) * [1, rng.uniform(0.2, 1)]
        return meshes.prism(corners, size * rng.uniform(0.01, 0.05))
    if kind == "large mesh":
        return meshes.ball(size, 80, 120)
    if kind == "open mesh":
        points, faces = meshes.ball(size, 8, 16)
        return points, faces[points[faces, 2].min(axis=1) < 0.4 * size]
    if kind == "concave":
        wall = rng.uniform(0.1, 0.4)
        profile = [[0, 0], [1, 0], [1, 1], [1 - wall, 1], [1 - wall, wall], [0, wall]]
        return meshes.revolved(size * np.array(profile, dtype=float), int(rng.integers(8, 32)))
    return meshes.ball(size, int(rng.integers(4, 20)), int(rng.integers(6, 40)))


def _upright(rng: np.random.Generator, size: float) -> Geom:
    """A geom with a flat face below."""
    kind = str(rng.choice(["box", "cylinder", "star", "prism"]))
    if kind == "box":
        return Geom(kind, kind, (size, size * rng.uniform(0.3, 1), size), mass=0.05)
    if kind == "cylinder":
        return Geom(kind, kind, (size, size), mass=0.05)
    outline = 3 + int(rng.integers(0, 5))
    if kind == "star":
        return Geom(kind, "mesh", mesh=meshes.star(size, 0.5 * size, size, outline), mass=0.05)
    angles = 2 * np.pi * np.arange(outline) / outline
    return Geom(
        kind, "mesh", mesh=meshes.prism(size * np.column_stack([np.cos(angles), np.sin(angles)]), size), mass=0.05
    )


def _smooth_heights(rng: np.random.Generator, count: int) -> Array:
    x, y = np.meshgrid(np.linspace(-1, 1, count), np.linspace(-1, 1, count))
    heights = np.zeros_like(x)
    for _ in range(4):
        a, b, phase = rng.normal(0, 3, 3)
        heights += rng.random() * np.sin(a * x + b * y + phase)
    return (heights - heights.min()) / np.ptp(heights)


# ----------------------------------------------------------------------------------------------------- poses


def _any_pose(rng: np.random.Generator) -> Array:
    """Flat, on a side, leaning a little from there, or any way."""
    choice = rng.random()
    if choice < 0.2:
        return any_rotation(rng)
    side = np.linalg.matrix_power(_facing_x(), int(rng.integers(0, 4))) if choice < 0.6 else np.eye(3)
    lean = _leaning(rng, rng.choice([0.0, 0.0, 1.0, 5.0, 20.0]))
    return _about_z(rng.choice([0.0, rng.uniform(0, 2 * np.pi)])) @ lean @ side


def any_rotation(rng: np.random.Generator) -> Array:
    """A rotation matrix, (3, 3)."""
    quat, matrix = rng.normal(size=4), np.empty(9)
    mujoco.mju_quat2Mat(matrix, quat / np.linalg.norm(quat))
    return matrix.reshape(3, 3)


def _leaning(rng: np.random.Generator, most_degrees: float) -> Array:
    angle, turn = np.radians(most_degrees) * rng.random(), _about_z(rng.uniform(0, 2 * np.pi))
    lean = np.array([[1, 0, 0], [0, np.cos(angle), -np.sin(angle)], [0, np.sin(angle), np.cos(angle)]])
    return turn @ lean @ turn.T


def _about_z(angle: float) -> Array:
    return np.array([[np.cos(angle), -np.sin(angle), 0], [np.sin(angle), np.cos(angle), 0], [0, 0, 1.0]])


def _facing_x() -> Array:
    """Turns z to x."""
    return np.array([[0, 0, 1.0], [0, 1, 0], [-1, 0, 0]])


def _lowest(body: Body) -> float:
    """Height of the lowest point of what collides, the body at its orientation and its origin at 0 [m]."""
    return -_reach(body, -body.rotation[2])


def _highest(body: Body) -> float:
    return _reach(body, body.rotation[2])


def _reach(body: Body, direction: Array) -> float:
    """How far what collides reaches along a direction in the body's frame [m]."""
    return max(_geom_reach(geom, direction) for geom in body.geoms if geom.collides)


def _geom_reach(geom: Geom, direction: Array) -> float:
    along, turned_to = geom.pos @ direction, geom.rotation.T @ direction
    if geom.mesh is not None:
        return float(along + (geom.mesh[0] @ turned_to).max())
    size = np.array(geom.size)
    extents = {
        "sphere": lambda: size[0],
        "capsule": lambda: size[0] + size[1] * abs(turned_to[2]),
        "cylinder": lambda: size[0] * np.hypot(*turned_to[:2]) + size[1] * abs(turned_to[2]),
        "box": lambda: size @ np.abs(turned_to),
        "ellipsoid": lambda: np.linalg.norm(size * turned_to),
    }
    if geom.type in extents:
        return float(along + extents[geom.type]())
    # A signed distance function: what it was scaled to, roughly.
    numbers = [float(part) for part in geom.sdf.split('value="')[1:] for part in [part.split('"')[0]]]
    return float(along + 1.1 * max(numbers))
