"""PadModel: the readings of InfluenceMatrices, with gradients, in batches; what it refuses, what it saves."""

from __future__ import annotations

import copy
import io
import pickle
import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch
from curved_pads import WALKED
from hypothesis import given, settings
from hypothesis import strategies as st
from shapely import box
from small_pads import COARSE, LAYERED_PAD, in_double_precision

from mjtactile import Footprint, Pad, contact_load, indenter_outline, influence_matrices, register_pad
from mjtactile.errors import InfluenceError, PadError, PresetError, SceneError, StaleInfluenceError
from mjtactile.fem.surface_grid import oriented_edges
from mjtactile.fidelity import PRESETS, Fidelity
from mjtactile.influence.matrices import InfluenceMatrices
from mjtactile.influence.surface_load import SurfaceLoad
from mjtactile.torch import PadModel

PAGE = Path(__file__).resolve().parents[2] / "docs" / "torch.md"
#: Of the largest reading: the bound for single precision, and rounding of sums for double.
TOLERANCE = {torch.float32: 1e-5, torch.float64: 1e-11}


@pytest.fixture(scope="module", params=["fast", "balanced"])
def preset(request: pytest.FixtureRequest) -> InfluenceMatrices:
    """Tables in bytes and factors, and with loads on corners and layers of different averaging."""
    return influence_matrices(fidelity=request.param, progress=False)


@pytest.fixture(scope="module")
def model(layered: InfluenceMatrices) -> PadModel:
    return PadModel(layered, stress=True, dtype=torch.float64)


def some_loads(influence: InfluenceMatrices, count: int, seed: int, largest: float) -> list[SurfaceLoad]:
    """Nodal forces at random, on a random part of the nodes [N]."""
    rng = np.random.default_rng(seed)
    surface = influence.surface
    forces = rng.normal(size=(count, *surface.node_shape, 3)) * (rng.random((count, *surface.node_shape, 1)) < 0.2)
    return [SurfaceLoad(largest * one, surface, surface.sheet) for one in forces]


def star(influence: InfluenceMatrices) -> Footprint:
    return Footprint.from_outline(indenter_outline("star", shift=(0.3e-3, -0.2e-3), scale=0.5), influence.surface)


def agree(given: torch.Tensor, wanted: np.ndarray, dtype: torch.dtype) -> None:
    assert given.dtype == dtype
    np.testing.assert_allclose(given.numpy(), wanted, rtol=0, atol=TOLERANCE[dtype] * np.abs(wanted).max())


@settings(max_examples=20, deadline=None)
@given(
    count=st.integers(1, 3),
    seed=st.integers(0, 2**32 - 1),
    exponent=st.integers(-8, 2),
    dtype=st.sampled_from([torch.float32, torch.float64]),
    layers=st.permutations(range(3)).flatmap(lambda order: st.integers(1, 3).map(lambda n: tuple(order[:n]))),
)
def test_readings_and_stress_are_those_of_numpy(layered, count, seed, exponent, dtype, layers):
    loads = some_loads(layered, count, seed, 10.0**exponent)
    model = PadModel(layered, layers=layers, stress=True, dtype=dtype)
    forces = model.nodal_forces(loads)
    found = model.readings_and_stress(forces)
    agree(model(forces), layered.readings(loads)[:, layers], dtype)
    agree(found.readings, layered.readings(loads)[:, layers], dtype)
    agree(found.stress, layered.stress(loads)[:, :, layers], dtype)
    agree(model.stress(forces), found.stress.numpy(), dtype)


@settings(max_examples=10, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), exponent=st.integers(-8, 2))
def test_every_storage_reads_as_numpy_does(preset, seed, exponent):
    loads = some_loads(preset, 2, seed, 10.0**exponent)
    model = PadModel(preset, stress=True)
    found = model.readings_and_stress(model.nodal_forces(loads))
    agree(found.readings, preset.readings(loads), torch.float32)
    agree(found.stress, preset.stress(loads), torch.float32)


@pytest.mark.parametrize("batch", [(), (0,), (1,), (2, 3)])
def test_any_batch_axes_lead(model, batch):
    forces = torch.randn(*batch, *model.force_shape, dtype=torch.float64)
    assert model(forces).shape == (*batch, *LAYERED_PAD.reading_shape)
    assert model.stress(forces).shape == (*batch, 6, *LAYERED_PAD.reading_shape)
    assert model.readings_of(model.point_response(forces)).shape == (*batch, *LAYERED_PAD.reading_shape)


def test_gradients_are_those_of_finite_differences(layered):
    model = PadModel(layered, stress=True, dtype=torch.float64)
    forces = torch.from_numpy(np.stack([load.forces for load in some_loads(layered, 2, 5, 1e-3)])).requires_grad_()
    # Readings are some 1e4 Pa: as shares of that, differences are told from rounding.
    assert torch.autograd.gradcheck(lambda f: model(f) / 1e4, forces, eps=1e-8, atol=1e-4, fast_mode=True)
    assert torch.autograd.gradcheck(lambda f: model.stress(f) / 1e4, forces, eps=1e-8, atol=1e-4, fast_mode=True)


def test_every_gradient_of_a_pressing_wrench_is_that_of_finite_differences(layered, model):
    basis = model.wrench_basis(star(layered))
    wrench = torch.tensor([0.02, -0.03, -0.2, 1e-5, 2e-5, -1e-5], dtype=torch.float64, requires_grad=True)
    unit = torch.tensor([1, 1, 1, 1e-3, 1e-3, 1e-3], dtype=torch.float64)

    def readings(wrench: torch.Tensor) -> torch.Tensor:
        return model(torch.einsum("w,wyxc->yxc", wrench * unit, basis)) / 1e4

    assert torch.autograd.gradcheck(readings, wrench / unit)


def test_the_gradient_without_stress_is_zero(model):
    forces = torch.zeros(model.force_shape, dtype=torch.float64, requires_grad=True)
    readings = model(forces)
    readings.sum().backward()
    assert forces.grad is not None
    assert (readings == 0).all()
    assert (forces.grad == 0).all()


@pytest.mark.parametrize("name", WALKED)
def test_curved_pads_and_free_taxels_read_as_in_numpy_with_gradients(name):
    influence = in_double_precision(WALKED[name], replace(COARSE, most_elements=64))
    model = PadModel(influence, stress=True, dtype=torch.float64)
    loads = some_loads(influence, 3, 4, 0.1)
    forces = model.nodal_forces(loads)
    agree(model(forces), influence.readings(loads), torch.float64)
    agree(model.stress(forces), influence.stress(loads), torch.float64)
    assert model.reading_shape == influence.pad.reading_shape
    chosen = forces[0].clone().requires_grad_()
    (gradient,) = torch.autograd.grad(model(chosen).sum(), chosen)
    step = torch.zeros_like(forces[0])
    step[4, 6, 2] = 1e-4
    change = (model(forces[0] + step) - model(forces[0] - step)).sum() / 2e-4
    assert float(gradient[4, 6, 2]) == pytest.approx(float(change), rel=1e-6)


def test_a_wrench_basis_is_refused_on_curved_pads():
    model = PadModel(in_double_precision(WALKED["dome"], replace(COARSE, most_elements=64)), dtype=torch.float64)
    face = Footprint.from_outline(box(-1e-3, -1e-3, 1e-3, 1e-3), model.surface)
    with pytest.raises(PadError, match=r"wrench_basis takes flat pads only.*not linear in its wrench.*nodal_forces"):
        model.wrench_basis(face)


@pytest.mark.parametrize("name", ["dome", "tip", "patch"])
def test_tractions_of_cells_of_a_curved_pad_are_per_area_of_its_surface(name):
    influence = in_double_precision(WALKED[name], replace(COARSE, most_elements=64))
    surface, model = influence.surface, PadModel(influence, dtype=torch.float64)
    x, y = surface.x.vertices, surface.y.vertices
    tractions = torch.zeros(len(y) - 1, len(x) - 1, 3, dtype=torch.float64)
    expected = np.zeros(model.force_shape)
    for row, column, traction in ((1, 2, (2e3, -1e3, -5e4)), (3, 0, (0.0, 3e3, -1e4))):
        tractions[row, column] = torch.tensor(traction, dtype=torch.float64)
        cell = box(x[column], y[row], x[column + 1], y[row + 1])
        load = SurfaceLoad.from_tractions(influence, cell, lambda points, _, t=traction: np.tile(t, (len(points), 1)))
        expected += load.forces
    tractions.requires_grad_()
    found = model.traction_forces(tractions)
    np.testing.assert_allclose(found.detach().numpy(), expected, atol=1e-12 * np.abs(expected).max())
    batch = model.traction_forces(torch.stack([tractions, 2 * tractions])[None])
    torch.testing.assert_close(batch[0, 1], 2 * found)
    (gradient,) = torch.autograd.grad(found[..., 2].sum(), tractions)
    area = float(surface.outer.stretch(*np.meshgrid((x[1:] + x[:-1]) / 2, (y[1:] + y[:-1]) / 2))[1, 2])
    assert float(gradient[1, 2, 2]) == pytest.approx(area * (x[3] - x[2]) * (y[2] - y[1]), rel=0.05)


def test_a_layer_left_out_is_not_kept(layered):
    def size(model: PadModel) -> int:
        return sum(buffer.numel() for buffer in model.buffers())

    one, every = PadModel(layered, layers=(1,)), PadModel(layered)
    forces = one.nodal_forces(some_loads(layered, 2, 1, 1.0))
    torch.testing.assert_close(one(forces), every(forces)[:, 1:2])
    assert size(one) < 0.5 * size(every)


def test_responses_add_up_and_scale(model):
    first, second = torch.randn(2, *model.force_shape, dtype=torch.float64)
    combined = 2.0 * model.point_response(first) - model.point_response(second)
    torch.testing.assert_close(model.readings_of(combined), model(2.0 * first - second))


def test_tractions_of_cells_become_the_nodal_forces_of_their_integrals(layered, model):
    x, y = layered.surface.x.vertices, layered.surface.y.vertices
    tractions = torch.zeros(len(y) - 1, len(x) - 1, 3, dtype=torch.float64)
    tractions[1, 4] = torch.tensor([2e3, -1e3, -5e4], dtype=torch.float64)
    tractions[2, 0] = torch.tensor([0.0, 3e3, -1e4], dtype=torch.float64)
    expected = np.zeros(model.force_shape)
    for row, column in ((1, 4), (2, 0)):
        edges = oriented_edges(box(x[column], y[row], x[column + 1], y[row + 1]))
        of_edges = np.tile(tractions[row, column].numpy(), (len(edges), 1))
        expected += layered.surface.traction_forces(edges, of_edges)
    np.testing.assert_allclose(model.traction_forces(tractions).numpy(), expected, atol=1e-12 * np.abs(expected).max())
    batch = model.traction_forces(torch.stack([tractions, 2 * tractions])[None])
    torch.testing.assert_close(batch[0, 1], 2 * model.traction_forces(tractions))


@settings(max_examples=10, deadline=None)
@given(
    shear=st.tuples(st.floats(-0.03, 0.03), st.floats(-0.03, 0.03)),
    pressing=st.floats(0.02, 0.2),
    off=st.tuples(st.floats(-1e-4, 1e-4), st.floats(-1e-4, 1e-4)),
    torsion=st.floats(-1e-5, 1e-5),
)
def test_a_wrench_on_a_footprint_is_law_uniforms(layered, model, shear, pressing, off, torsion):
    footprint = star(layered)
    x, y = np.array(footprint.outline.centroid.coords[0]) + off
    force, moment = np.array([*shear, -pressing]), np.array([-y * pressing, x * pressing, torsion])
    load = contact_load(layered, footprint, force=force, moment=moment, law="uniform")
    wrench = torch.from_numpy(np.concatenate([force, moment]))
    found = torch.einsum("w,wyxc->yxc", wrench, model.wrench_basis(footprint)).numpy()
    np.testing.assert_allclose(found, load.forces, rtol=0, atol=1e-11 * np.abs(load.forces).max())


def test_a_pad_may_be_named_saved_or_given_with_a_fidelity(layered, tmp_path):
    layered.save(tmp_path / "layered.safetensors")
    register_pad("layered for torch", LAYERED_PAD)
    rough = Fidelity(mesh=COARSE)
    forces = torch.randn(*PadModel(layered).force_shape)
    expected = PadModel(layered)(forces)
    for model in (
        PadModel(tmp_path / "layered.safetensors"),
        PadModel(str(tmp_path / "layered.safetensors")),
        PadModel(LAYERED_PAD, fidelity=rough),
        PadModel("layered for torch", fidelity=rough),
    ):
        torch.testing.assert_close(model(forces), expected, rtol=0, atol=1e-5 * expected.max().item())
    assert PadModel().fidelity == influence_matrices(fidelity="balanced").fidelity


def test_a_state_dictionary_holds_the_fingerprint_and_is_refused_by_another_pad(layered):
    model = PadModel(layered)
    network = torch.nn.Sequential(model, torch.nn.Flatten(), torch.nn.Linear(60, 2))
    assert {name for name, _ in network.named_parameters()} == {"2.weight", "2.bias"}
    file = io.BytesIO()
    torch.save(network.state_dict(), file)
    assert file.tell() < 10_000
    file.seek(0)
    state = torch.load(file, weights_only=True)
    same = torch.nn.Sequential(PadModel(layered), torch.nn.Flatten(), torch.nn.Linear(60, 2))
    same.load_state_dict(state)
    forces = torch.randn(3, *model.force_shape)
    torch.testing.assert_close(same(forces), network(forces), rtol=0, atol=0)
    own = model.state_dict()
    with pytest.raises(
        StaleInfluenceError, match=f"pad fingerprint {LAYERED_PAD.fingerprint}.*has {Pad().fingerprint}"
    ):
        PadModel(fidelity="fast").load_state_dict(own)
    with pytest.raises(StaleInfluenceError, match=r"layers \[0, 1, 2\].*has \[0\]"):
        PadModel(layered, layers=(0,)).load_state_dict(own)
    with pytest.raises(RuntimeError, match="_extra_state"):
        PadModel(layered).load_state_dict({})
    with pytest.raises(StaleInfluenceError, match="holds None in place of a pad's fingerprint"):
        PadModel(layered).load_state_dict({"_extra_state": None})


def test_a_checkpoint_of_layers_counted_by_numpy_is_loaded_safely(layered):
    file = io.BytesIO()
    counted: list[Any] = list(np.arange(2))
    torch.save(PadModel(layered, layers=counted).state_dict(), file)
    file.seek(0)
    PadModel(layered, layers=(0, 1)).load_state_dict(torch.load(file, weights_only=True))


def test_copies_pickles_and_other_types_read_the_same(layered):
    model = PadModel(layered)
    forces = torch.randn(2, *model.force_shape)
    for other in (copy.deepcopy(model), pickle.loads(pickle.dumps(model))):
        torch.testing.assert_close(other(forces), model(forces), rtol=0, atol=0)
    wide = copy.deepcopy(model).to(torch.float64)
    assert wide.dtype == torch.float64
    torch.testing.assert_close(
        wide(forces.double()).float(), model(forces), rtol=0, atol=1e-5 * model(forces).max().item()
    )


def test_autocast_does_not_round_the_readings(layered):
    model = PadModel(layered, stress=True)
    forces = torch.randn(2, *model.force_shape)
    expected = model.readings_and_stress(forces)
    with torch.autocast("cpu", dtype=torch.bfloat16):
        torch.testing.assert_close(model(forces), expected.readings, rtol=0, atol=0)
        torch.testing.assert_close(model.stress(forces), expected.stress, rtol=0, atol=0)


@pytest.mark.skipif(not torch.cuda.is_available(), reason="no GPU")
def test_a_gpu_reads_as_numpy_does(layered):
    loads = some_loads(layered, 3, 7, 1e-2)
    for dtype in TOLERANCE:
        model = PadModel(layered, stress=True, dtype=dtype, device="cuda")
        forces = model.nodal_forces(loads)
        agree(model(forces).cpu(), layered.readings(loads), dtype)
        agree(model.stress(forces).cpu(), layered.stress(loads), dtype)
        with pytest.raises(InfluenceError, match="device of forces is cpu, but the model's is cuda:0"):
            model(forces.cpu())


@pytest.mark.parametrize(
    ("wrong", "said"),
    [
        (lambda shape: np.zeros(shape, np.float32), r"forces are of type ndarray; expected a tensor.*nodal_forces"),
        (lambda shape: torch.zeros(shape)[1:], r"forces have shape .*expected \(\.\.\., nodes y, nodes x, 3\)"),
        (lambda shape: torch.zeros(shape[:-1]), r"forces have shape .*expected \(\.\.\., nodes y, nodes x, 3\)"),
        (
            lambda shape: torch.zeros(shape).double(),
            r"dtype of forces is torch.float64, but the model's is torch.float32",
        ),
        (lambda shape: torch.zeros(shape, device="meta"), r"device of forces is meta, but the model's is cpu"),
    ],
)
def test_loads_that_do_not_fit_are_refused_with_the_cure(layered, wrong, said):
    model = PadModel(layered)
    with pytest.raises(InfluenceError, match=said):
        model(wrong(model.force_shape))


def test_what_the_model_cannot_do_is_said(layered, draft):
    model = PadModel(layered)
    with pytest.raises(InfluenceError, match=r"device 'foo': .* Use \"cpu\""):
        PadModel(layered, device="foo")
    with pytest.raises(InfluenceError, match="stress=True"):
        model.stress(torch.zeros(model.force_shape))
    with pytest.raises(InfluenceError, match=r"this model makes \(\.\.\., \d+, 5\)"):
        model.readings_of(torch.zeros(7, 5))
    with pytest.raises(InfluenceError, match="tractions have shape"):
        model.traction_forces(torch.zeros(model.force_shape))
    with pytest.raises(InfluenceError, match="made for another pad or mesh"):
        model.nodal_forces(some_loads(draft, 1, 1, 1.0))
    with pytest.raises(InfluenceError, match="same pad and fidelity"):
        model.wrench_basis(star(draft))
    with pytest.raises(InfluenceError, match=r"footprint is of type NoneType; expected a mjtactile\.Footprint"):
        model.wrench_basis(None)  # type: ignore[arg-type]
    with pytest.raises(InfluenceError, match=r"response is of type NoneType; expected a torch\.Tensor"):
        model.readings_of(None)  # type: ignore[arg-type]
    response = model.point_response(torch.zeros(model.force_shape))
    with pytest.raises(InfluenceError, match=r"dtype of response is torch\.float64, but the model's is torch\.float32"):
        model.readings_of(response.double())


@pytest.mark.parametrize(
    ("arguments", "error", "said"),
    [
        ({"layers": ()}, InfluenceError, r"layers = \(\); expected some of \(0, 1, 2\)"),
        ({"layers": (0, 3)}, InfluenceError, "each once, counted from the top"),
        ({"layers": (1, 1)}, InfluenceError, "each once"),
        ({"layers": [0.0]}, InfluenceError, r"layers = \[0\.0\]; expected"),
        ({"layers": 1}, InfluenceError, "layers = 1; expected"),
        ({"dtype": torch.float16}, InfluenceError, r"float16 is not supported.*torch\.float32 or torch\.float64"),
        ({"fidelity": "fast"}, PresetError, "which have their own"),
    ],
)
def test_a_model_that_cannot_be_made_is_refused(layered, arguments, error, said):
    with pytest.raises(error, match=said):
        PadModel(layered, **arguments)


def test_a_model_made_half_is_refused_where_its_stresses_would_overflow(layered):
    model = PadModel(layered).half()
    with pytest.raises(InfluenceError, match=r"float16 is not supported; expected torch\.float32 or torch\.float64"):
        model(torch.zeros(model.force_shape, dtype=torch.float16))


def test_a_pad_that_nobody_knows_is_refused():
    for name in ("no such pad", Path("no such pad")):
        with pytest.raises(SceneError, match="register_pad"):
            PadModel(name)
    with pytest.raises(InfluenceError, match="not a whole influence table"):
        PadModel(__file__)


def test_a_pads_file_serves_as_well(tmp_path):
    (tmp_path / "pad.toml").write_text("depths = [1e-3]")
    assert PadModel(tmp_path / "pad.toml", fidelity="fast").pad == Pad(depths=(1e-3,))


def test_the_page_finds_what_it_says_it_finds():
    blocks = re.findall(r"```python\n(.*?)```", PAGE.read_text(), flags=re.DOTALL)
    names: dict = {}
    for block in blocks:
        exec(compile(block, str(PAGE), "exec"), names)
    assert names["readings"].shape == (4, 4, 13, 13)
    assert torch.allclose(names["found"][:3], torch.tensor([0.12, -0.05, -0.8]), atol=1e-4)
    assert torch.allclose(names["found"][3:], torch.tensor([-0.8 * 0.4e-3, 0.8e-3, -9.8e-5]), atol=1e-6)
    assert names["pressing"] == pytest.approx(0.8, rel=0.03)
    tables = re.findall(r"<!-- bench torch \w+ -->\n(.*?)<!-- end -->", PAGE.read_text(), flags=re.DOTALL)
    assert [re.findall(r"^\| (\w+) \| [\d.]", table, flags=re.MULTILINE) for table in tables] == [list(PRESETS)] * 2
