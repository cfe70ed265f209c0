"""Press scenes: the force commanded is the force felt, soon and in the right place, for every shape."""

import itertools
import runpy
from pathlib import Path
from typing import Any, cast

import mujoco
import numpy as np
import pytest
import shapely
import trimesh
from mujoco_versions import older_than

from mjtactile.errors import IndenterError, PadError, SceneError
from mjtactile.geometry.indenter import (
    box,
    cylinder,
    indenter_outline,
    indenter_solid,
    mesh_indenter,
    sphere,
)
from mjtactile.geometry.outlines import INDENTER_NAMES
from mjtactile.geometry.solid import face_outline
from mjtactile.pad import Layer, Pad, TaxelGrid, force_vector
from mjtactile.sim.assets import asset_path, available_assets
from mjtactile.sim.press_scene import press, press_scene, press_spec
from mjtactile.sim.wrench import contact_wrench

REPOSITORY = Path(__file__).parents[2]
GRAM_FORCE = 9.80665e-3  # [N]
POSES = [((0.0, 0.0), 0.0), ((1.25e-3, 1.25e-3), 17.0), ((-1.25e-3, 0.0), 45.0)]
LYING_CYLINDER = cylinder(3e-3, 8e-3)
OTHERS = [sphere(6e-3), LYING_CYLINDER, cylinder(3e-3, 8e-3, "z"), box((6e-3, 4e-3, 5e-3))]
FORCES = [
    force_vector(grams * GRAM_FORCE, tilt, azimuth)
    for grams, (tilt, azimuth) in itertools.product((10, 50, 200), ((0, 0), (15, 0), (15, 200), (35, 90), (35, 300)))
]


def felt(model: mujoco.MjModel, data: mujoco.MjData) -> np.ndarray:
    return contact_wrench(model, data, model.geom("pad").id)


def centre_of_pressure(wrench: np.ndarray) -> np.ndarray:
    return np.array([-wrench[4], wrench[3]]) / wrench[2]


@pytest.mark.parametrize("tilt_free", [False, True], ids=["upright", "free"])
@pytest.mark.parametrize("shape", [*INDENTER_NAMES, *OTHERS], ids=lambda shape: getattr(shape, "name", shape))
def test_force_is_reached_within_50_ms_and_stays(shape, tilt_free):
    if shape is LYING_CYLINDER and tilt_free and older_than("3.17"):
        pytest.skip("MuJoCo before 3.17: a lying cylinder touches in one point, which jumps from end to end")
    # MuJoCo 3.17 places the two contact points of a cylinder that rolls on its side unsteadily: 0.13 % was seen.
    tolerance = 5e-3 if shape is LYING_CYLINDER and tilt_free else 1e-3
    for shift, angle in POSES:
        model = press_scene(shape, shift=shift, rotate_deg=angle, tilt_free=tilt_free)
        data = mujoco.MjData(model)
        for force in FORCES:
            mujoco.mj_resetData(model, data)
            data.ctrl[:] = force
            mujoco.mj_step(model, data, 49)
            for _ in range(5):
                mujoco.mj_step(model, data, 2)
                wrench = felt(model, data)
                assert abs(wrench[2] - force[2]) < tolerance * abs(force[2])
                tangential = np.linalg.norm(force[:2])
                assert np.linalg.norm(wrench[:2] - force[:2]) < tolerance * (tangential or np.linalg.norm(force))


@pytest.mark.parametrize("shape", INDENTER_NAMES)
def test_an_upright_punch_presses_about_the_centroid_of_its_face(shape):
    for (shift, angle), grams in itertools.product(POSES, (10, 200)):
        model = press_scene(shape, shift=shift, rotate_deg=angle)
        result = press(model, mujoco.MjData(model), force_vector(grams * GRAM_FORCE))
        sheet = shapely.box(-7.5e-3, -7.5e-3, 7.5e-3, 7.5e-3)
        centre = indenter_outline(shape, shift=shift, rotate_deg=angle).intersection(sheet).centroid
        np.testing.assert_allclose(centre_of_pressure(result.wrench), centre.coords[0], atol=1e-6)


@pytest.mark.parametrize("shape", INDENTER_NAMES)
def test_a_punch_that_overhangs_presses_about_the_part_over_the_pad(shape):
    shift = (5.5e-3, -4e-3)
    model = press_scene(shape, shift=shift, rotate_deg=30.0)
    result = press(model, mujoco.MjData(model), force_vector(50 * GRAM_FORCE))
    part = indenter_outline(shape, shift=shift, rotate_deg=30.0).intersection(
        shapely.box(-7.5e-3, -7.5e-3, 7.5e-3, 7.5e-3)
    )
    np.testing.assert_allclose(centre_of_pressure(result.wrench), part.centroid.coords[0], atol=1e-6)


@pytest.mark.parametrize("shape", INDENTER_NAMES)
def test_a_free_punch_takes_its_load_through_the_middle_of_its_face(shape):
    shift = (1e-3, -0.5e-3)
    model = press_scene(shape, shift=shift, rotate_deg=20.0, tilt_free=True)
    data = mujoco.MjData(model)
    result = press(model, data, force_vector(100 * GRAM_FORCE, 35.0, 60.0))
    middle = np.add(shift, data.qpos[:2])
    np.testing.assert_allclose(centre_of_pressure(result.wrench), middle, atol=1e-5)


def test_an_oblique_press_hardly_moves_the_punch():
    for shape in INDENTER_NAMES:
        model = press_scene(shape)
        data = mujoco.MjData(model)
        press(model, data, force_vector(200 * GRAM_FORCE, 35.0))
        assert np.linalg.norm(data.qpos[:2]) < 3e-5
        assert -1.5e-5 < data.qpos[2] < 0.0
        mujoco.mj_step(model, data, 1000)
        assert np.linalg.norm(data.qvel[:2]) < 1e-5  # it creeps under 0.01 mm/s


def test_nothing_touches_before_the_press():
    for shape in (*INDENTER_NAMES, *OTHERS):
        model = press_scene(shape)
        data = mujoco.MjData(model)
        mujoco.mj_step(model, data, 20)
        assert data.ncon == 0


def test_the_punch_has_no_weight_for_the_pad():
    model = press_scene("star")
    assert model.opt.gravity[2] < 0.0
    assert model.opt.jacobian == mujoco.mjtJacobian.mjJAC_DENSE
    force = force_vector(10 * GRAM_FORCE, 15.0, 40.0)
    wrench = press(model, mujoco.MjData(model), force).wrench
    model.opt.gravity[:] = 0.0
    np.testing.assert_allclose(press(model, mujoco.MjData(model), force).wrench, wrench, rtol=1e-6, atol=1e-9)


def test_a_second_press_goes_on_from_the_first():
    model = press_scene("square")
    data = mujoco.MjData(model)
    first = press(model, data, force_vector(0.5))
    second = press(model, data, force_vector(1.0, 10.0))
    assert data.time == pytest.approx(first.time + second.time)
    assert second.steps == pytest.approx(second.time / model.opt.timestep)
    np.testing.assert_allclose(second.wrench[:3], force_vector(1.0, 10.0), atol=1e-4)
    assert second.error <= 1e-4


def test_force_vector_points_into_the_pad_and_leans_to_its_azimuth():
    np.testing.assert_allclose(force_vector(2.0), (0.0, 0.0, -2.0), atol=1e-15)
    sine, cosine = np.sin(np.radians(15.0)), np.cos(np.radians(15.0))
    np.testing.assert_allclose(force_vector(2.0, 15.0), (2 * sine, 0.0, -2 * cosine), atol=1e-15)
    np.testing.assert_allclose(force_vector(2.0, 15.0, 90.0), (0.0, 2 * sine, -2 * cosine), atol=1e-15)


@pytest.mark.parametrize("shape", INDENTER_NAMES)
def test_the_solid_in_the_model_shows_the_true_outline_where_it_was_placed(shape):
    model = press_scene(shape, shift=(1e-3, -2e-3), rotate_deg=25.0)
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    geom = model.geom(f"{shape}_tactile")
    assert geom.group[0] == 2
    assert geom.contype[0] == geom.conaffinity[0] == 0
    mesh = model.mesh(int(geom.dataid[0]))
    vertices = model.mesh_vert[mesh.vertadr[0] : mesh.vertadr[0] + mesh.vertnum[0]].astype(float)
    faces = model.mesh_face[mesh.faceadr[0] : mesh.faceadr[0] + mesh.facenum[0]]
    world = vertices @ data.geom_xmat[geom.id].reshape(3, 3).T + data.geom_xpos[geom.id]
    section = face_outline(trimesh.Trimesh(world, faces, process=False), 1e-6, tolerance=2e-9)
    expected = indenter_outline(shape, shift=(1e-3, -2e-3), rotate_deg=25.0)
    assert section.symmetric_difference(expected).area < 1e-6 * expected.area


def test_the_pad_is_as_large_and_thick_as_asked():
    pad = Pad(
        size=(20e-3, 12e-3),
        layers=(Layer(thickness=1e-3, young=1e6, poisson=0.45), Layer(thickness=2e-3, young=3e6, poisson=0.49)),
        taxels=TaxelGrid(rows=3, columns=3),
        depths=(0.5e-3,),
    )
    model = press_scene("circle", pad=pad)
    np.testing.assert_allclose(model.geom("pad").size, (10e-3, 6e-3, 1.5e-3))
    np.testing.assert_allclose(model.geom("pad").pos, (0.0, 0.0, -1.5e-3))
    press_scene("circle", pad=pad, shift=(14e-3, 0.0))
    with pytest.raises(SceneError, match="misses the pad"):
        press_scene("circle", pad=pad, shift=(0.0, 12e-3))


def test_meshes_press_too(tmp_path):
    star = press_scene(mesh_indenter(indenter_solid("star"), name="my_star"))
    assert press(star, mujoco.MjData(star), force_vector(0.5)).error < 1e-4
    path = tmp_path / "star.stl"
    indenter_solid("star").export(path)
    for file in (path, str(path)):
        from_file = press_scene(file)
        assert press(from_file, mujoco.MjData(from_file), force_vector(0.5)).error < 1e-4
    ball = press_scene(trimesh.creation.icosphere(radius=4e-3), shift=(2e-3, 0.0))
    result = press(ball, mujoco.MjData(ball), force_vector(0.5))
    np.testing.assert_allclose(centre_of_pressure(result.wrench), (2e-3, 0.0), atol=5e-4)


def test_the_scene_can_be_edited_before_it_is_compiled():
    spec = press_spec("star")
    spec.option.timestep = 5e-4
    assert spec.compile().opt.timestep == 5e-4


@pytest.mark.parametrize(
    ("make", "error", "message"),
    [
        (lambda: press_scene("hexagon"), IndenterError, r"Available: circle"),
        (lambda: press_scene("none.stl"), IndenterError, "no mesh file none.stl"),
        (lambda: press_scene(cast(Any, None)), IndenterError, "of type NoneType; expected a trimesh.Trimesh"),
        (lambda: force_vector(cast(Any, "1N")), PadError, "magnitude = '1N'; expected a finite number"),
        (lambda: press_scene("star", shift=(13e-3, 0.0)), SceneError, "misses the pad.*Shift it less"),
        (lambda: press_scene("square", shift=(12.45e-3, 0.0)), SceneError, "only a sliver of indenter 'square'"),
        (lambda: press_star((0.0, 0.0, 0.1)), SceneError, "does not press"),
        (lambda: press_star((0.0, 0.0, -100.0)), SceneError, r"range.*at most 2\.5 N \(254\.9 gf\)"),
        (lambda: press_star((0.0, np.nan, -1.0)), SceneError, "three finite numbers"),
        (
            lambda: press_star(cast(Any, [(0.0,), -1.0])),
            SceneError,
            r"force = \[\(0.0,\), -1.0\]; expected three finite",
        ),
        (lambda: press_star(cast(Any, None)), SceneError, "force = None; expected three finite numbers"),
        (lambda: press_star(force_vector(1.0), time_limit=np.nan), SceneError, "time_limit = nan; expected a positive"),
        (lambda: press_star(force_vector(1.0), time_limit=np.inf), SceneError, "time_limit = inf; expected a positive"),
        (lambda: press_star(force_vector(1.0), tolerance=0.0), SceneError, "tolerance = 0.0; expected a positive"),
        (lambda: press_data_of_another_model(), SceneError, "data belongs to another model; expected .*press scene"),
        (lambda: press_scene("star", pad=cast(Any, [])), PadError, "pad is of type list; expected a mjtactile.Pad"),
        (
            lambda: press_star(force_vector(1.0, 50.0)),
            SceneError,
            "% off. Friction 1 holds forces tilted by up to 45 degrees",
        ),
        (
            lambda: press_scene("star", tilt_free="no"),  # type: ignore[arg-type]
            SceneError,
            "tilt_free is of type str; expected True or False",
        ),
        (lambda: press_without_actuators(), SceneError, r"actuator 'press_x' does not exist.*Available: \[\]"),
        (lambda: asset_path("scenes/none.xml"), SceneError, r"Available: \['models/xml/box.xml'"),
    ],
)
def test_errors_say_what_is_wrong_and_what_helps(make, error, message):
    with pytest.raises(error, match=message):
        make()


def press_star(force, **options):
    model = press_scene("star")
    return press(model, mujoco.MjData(model), force, **options)


def press_data_of_another_model():
    of_another = mujoco.MjData(mujoco.MjModel.from_xml_path(str(asset_path("models/xml/pad.xml"))))
    return press(press_scene("star"), of_another, force_vector(1.0))


def press_without_actuators():
    model = mujoco.MjModel.from_xml_path(str(asset_path("models/xml/pad.xml")))
    return press(model, mujoco.MjData(model), force_vector(1.0))


def test_committed_models_are_those_the_code_makes():
    generated = runpy.run_path(str(REPOSITORY / "models" / "generate.py"))["files"]()
    assert sorted(generated) == available_assets()
    for name, text in generated.items():
        assert asset_path(name).read_text() == text, f"{name} is stale: run python models/generate.py"


@pytest.mark.parametrize("name", available_assets())
def test_every_model_compiles_as_it_is(name):
    model = mujoco.MjModel.from_xml_path(str(asset_path(name)))
    if name.startswith("scenes/"):
        assert model.opt.jacobian == mujoco.mjtJacobian.mjJAC_DENSE
    if name.startswith("scenes/press"):
        assert press(model, mujoco.MjData(model), force_vector(1.0, 20.0)).time < 0.05


def test_the_pad_attaches_to_another_body():
    finger = mujoco.MjSpec.from_string(
        '<mujoco><worldbody><body name="finger"><geom size="0.01"/><freejoint/><site name="tip" pos="0 0 0.02"/></body>'
        "</worldbody></mujoco>"
    )
    pad = mujoco.MjSpec.from_file(str(asset_path("models/xml/pad.xml")))
    finger.attach(pad, prefix="ff_", site=finger.site("tip"))
    model = finger.compile()
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    np.testing.assert_allclose(data.site("ff_pad_surface").xpos, (0.0, 0.0, 0.02))
    assert model.geom("ff_pad").priority[0] == 1
