from __future__ import annotations

import json
import math
import shutil
from dataclasses import replace

import numpy as np
import pytest
from typer.testing import CliRunner

from mjtactile.cli.evaluate import side_by_side, tables
from mjtactile.cli.main import app
from mjtactile.dataset.files import make_dataset
from mjtactile.errors import RecognitionError
from mjtactile.pad import Layer, Pad
from mjtactile.recognition import trained_pad
from mjtactile.recognition.evaluation import recognisers as of_recognisers
from mjtactile.recognition.evaluation.arrays import TransducerArray, noisy
from mjtactile.recognition.evaluation.recognisers import (
    EvaluationSettings,
    angles_between,
    evaluate,
    protocol,
    recognisers,
)
from mjtactile.recognition.registry import REGISTRY, read_registry, register
from mjtactile.recognition.weight_files import SHIPPED, read_weights, write_weights
from mjtactile.transducer.imperfections import Imperfections


def test_small_angles_are_exact():
    turned = np.array([[math.sin(1e-6), 0.0, -math.cos(1e-6)]])
    assert angles_between(3.0 * turned, np.array([[0.0, 0.0, -1.0]]))[0] == pytest.approx(1e-6, rel=1e-6)


def test_noise_is_relative_to_each_presss_largest_reading_and_seeded():
    readings = np.random.default_rng(0).random((50, 4, 13, 13)) * np.geomspace(1, 1e4, 50)[:, None, None, None]
    change = noisy(readings, 0.02, seed=1) - readings
    relative = change.reshape(50, -1).std(axis=1) / readings.max(axis=(1, 2, 3))
    np.testing.assert_allclose(relative, 0.02, rtol=0.15)
    np.testing.assert_array_equal(noisy(readings, 0.02, seed=1), noisy(readings, 0.02, seed=1))


def test_arrays_differ_by_seed_and_calibration_takes_their_spread_out():
    readings = np.random.default_rng(6).uniform(0.0, 50e3, (3, 4, 13, 13))
    spread = Imperfections(noise=2e-3, gain_spread=0.02, offset_spread=2e-3)
    plain = TransducerArray(imperfections=spread)
    np.testing.assert_array_equal(plain.reported(readings, 1), plain.reported(readings, 1))
    assert (plain.reported(readings, 1) != plain.reported(readings, 2)).any()
    several = replace(plain, readings=16)
    off, mean_off, calibrated_off = (
        np.abs(array.reported(readings, 1) - readings).mean()
        for array in (plain, several, replace(several, calibrated=True))
    )
    assert off > mean_off > 3.0 * calibrated_off


@pytest.mark.slow
def test_bounds_hold_on_fresh_presses():
    """Bounds, on presses from a seed of this test's own; twice the bound where a small sample decides."""
    settings = EvaluationSettings(seed=7321, presses=160)
    result = evaluate(settings, workers=1, progress=False)
    protocol, fresh = result["protocol"]["all"], result["mujoco"]["all"]
    assert protocol["direction_deg"] <= 0.05
    assert protocol["magnitude_gf"] <= 0.05
    assert protocol["shapes_right"] == protocol["shapes_asked"] == 56
    assert set(protocol["three_rate"].values()) == {1.0}
    assert fresh["direction_median_deg"] <= 0.5
    assert fresh["magnitude_of_200gf"] <= 0.005
    assert fresh["position_mean_mm"] <= 0.1
    assert fresh["shape_rate"] >= 0.98
    assert fresh["unfamiliar_rate"] <= 0.03
    assert set(fresh["three_rate"].values()) == {1.0}
    # Four layers tell direction better than one where there is noise.
    assert fresh["direction_median_deg"] < result["mujoco"]["top"]["direction_median_deg"]
    assert "<= 0.05" in tables(result)


def test_sensors_side_by_side_have_a_column_each():
    """From results made up, because measuring takes long."""
    protocol = {
        "direction_deg": 0.1,
        "magnitude_gf": 0.2,
        "shapes_right": 55,
        "shapes_asked": 56,
        "three_rate": dict.fromkeys(("circle", "triangle", "square"), 1.0),
    }
    mujoco = {
        "direction_median_deg": 0.3,
        "magnitude_of_200gf": 0.004,
        "position_mean_mm": 0.05,
        "shape_rate": 0.997,
        "three_rate": protocol["three_rate"],
    }
    result = {"seed": 1, "presses": 20, "preset": "fast", "law": "uniform", "pad": Pad().summary}
    result |= {"protocol": {"all": protocol, "top": protocol}, "mujoco": {"all": mujoco, "top": mujoco}}
    text = side_by_side([result, {**result, "preset": "precise", "law": "elastic"}])
    assert "| figure | unit | bound | fast, uniform | precise, elastic |" in text
    assert "| magnitude, MuJoCo, mean | % of 200 gf | <= 0.5 | 0.400 / 0.400 | 0.400 / 0.400 |" in text
    assert "55 of 56 / 55 of 56" in text


def test_what_could_not_be_measured_is_a_dash_in_tables():
    """Of few presses none may be a square, none tilted and none hard."""
    rate = {"circle": 1.0, "triangle": 0.5, "square": math.nan}
    names = ("direction_deg", "magnitude_gf", "direction_median_deg", "magnitude_mean_gf", "magnitude_of_200gf")
    unknown = dict.fromkeys(
        (*names, "position_mean_mm", "shape_rate", "shape_rate_firm", "rate", "unfamiliar_rate"), math.nan
    )
    figures = {**unknown, "shapes_right": 0, "shapes_asked": 0, "three_rate": rate}
    both = dict.fromkeys(("all", "top"), figures | {"by_shape": {"star": {"presses": 4, **unknown}}})
    result = {"seed": 1, "presses": 4, "preset": "fast", "law": "uniform", "pad": Pad().summary}
    result |= {"protocol": both, "mujoco": both, "noise": [{"noise": 0.01, **both}]}
    rod = {"contacts": 1, "unfamiliar": math.nan, "wrong": 0.5, "confident": 0.5, "missed": math.nan}
    strangers = {layers: {"a lying rod": rod} for layers in ("all", "top")}
    text = tables(result | {"transducers": [{"transducer": "capacitive", **both}], "strangers": strangers})
    assert "nan" not in text
    assert "| circle / triangle / square, MuJoCo | % | 100 / 100 / 100 | 100 / 50 / - | 100 / 50 / - |" in text
    assert "| star | 4 | - / - | - / - | - / - | - / - | - / - |" in text
    assert "| a lying rod | 1 | - / - | 50 / 50 | 50 / 50 | - / - |" in text


def test_weights_are_evaluated_on_the_pad_that_they_are_for(tmp_path, monkeypatch):
    """Asked of the shipped weights under another pad's name: recognisers that fit take minutes to train."""
    stiff = Pad(layers=(Layer(thickness=5e-3, young=6e6, poisson=0.49),))
    for layers in ("all", "top"):
        shutil.copytree(SHIPPED / layers, tmp_path / layers)
        for path in (tmp_path / layers).glob("*.safetensors"):
            stored = read_weights(path)
            kept = {name: stored.metadata[name] for name in ("kind", "layers", "shape") if name in stored.metadata}
            write_weights(path, stored.arrays, kept, stiff)
            register(tmp_path / layers, path.name, optional=path.stem in ("shape-hexagon", "shape-cross"))
    assert trained_pad(folder=tmp_path) == stiff
    assert trained_pad() == Pad()

    pressed = []
    monkeypatch.setattr(of_recognisers, "ARRAYS", {})
    monkeypatch.setattr(of_recognisers, "NOISES", ())
    monkeypatch.setattr(
        of_recognisers, "make_dataset", lambda spec, *a, **k: pressed.append(spec.pad) or make_dataset(spec, *a, **k)
    )
    monkeypatch.setattr(
        of_recognisers, "protocol", lambda influence, *pair: pressed.append(influence.pad) or protocol(influence, *pair)
    )
    settings = EvaluationSettings(seed=1, presses=20, fidelity="fast")
    result = evaluate(settings, workers=1, folder=tmp_path, progress=False)
    assert pressed == [stiff] * 3
    assert result["pad"] == stiff.summary
    # Of one material, force makes the same stress in stiffer ones.
    assert result["mujoco"]["all"]["direction_median_deg"] < 1.0

    shutil.rmtree(tmp_path / "top")
    shutil.copytree(SHIPPED / "top", tmp_path / "top")
    with pytest.raises(RecognitionError, match=r"was trained for a .*E 3 MPa.*but the pad is a .*E 6 MPa"):
        recognisers(tmp_path)


def test_what_could_not_be_measured_is_null_in_json(monkeypatch):
    results = {"rate": math.nan, "rows": [{"noise": 0.0, "found": -math.inf}], "three": (1, True, "nan", None)}
    monkeypatch.setattr("mjtactile.recognition.evaluation.recognisers.evaluate", lambda *_, **__: results)
    monkeypatch.setattr("mjtactile.cli.evaluate.tables", lambda _: "")
    done = CliRunner().invoke(app, ["evaluate", "--json"])
    assert done.exit_code == 0, done.output
    found = json.loads(done.stdout, parse_constant=pytest.fail)
    assert found == {"rate": None, "rows": [{"noise": 0.0, "found": None}], "three": [1, True, "nan", None]}


@pytest.mark.parametrize("folder", [SHIPPED, SHIPPED / "all", SHIPPED / "top"])
def test_a_folder_of_weights_or_one_of_its_layers_is_evaluated(folder):
    pad, pairs = recognisers(folder)
    assert pad == Pad()
    assert {layers: force.view.layers for layers, (force, _) in pairs.items()} == {"all": (0, 1, 2, 3), "top": (0,)}


def test_the_layers_that_a_folder_lacks_are_named(tmp_path):
    shutil.copytree(SHIPPED / "all", tmp_path / "all")
    with pytest.raises(RecognitionError, match=r"nor in its subfolder top\. Train them"):
        recognisers(tmp_path / "all")


def test_weights_that_do_not_know_the_punches_are_refused_before_presses_are_made(tmp_path):
    for layers in ("all", "top"):
        shutil.copytree(SHIPPED / layers, tmp_path / layers)
        modules = [entry for name, entry in read_registry(SHIPPED / layers).items() if name != "shape star"]
        (tmp_path / layers / REGISTRY).unlink()
        for entry in modules:
            register(tmp_path / layers, entry.file, optional=entry.optional)
    with pytest.raises(RecognitionError, match="layers 'all' know no star, but the evaluation presses all seven"):
        recognisers(tmp_path)


@pytest.fixture(scope="module")
def by_law(tmp_path_factory) -> tuple[list[dict], str]:
    """What the command prints of two laws, and the page it rewrites."""
    page = tmp_path_factory.mktemp("page") / "page.md"
    page.write_text("<!-- bench evaluate sensors -->\n<!-- end -->\n")
    asked = ["--presses", "20", "--workers", "1", "--fidelity", "fast", "--law", "uniform", "--law", "foundation"]
    done = CliRunner().invoke(app, ["evaluate", *asked, "--json", "--page", str(page)])
    assert done.exit_code == 0, done.output
    return json.loads(done.stdout), page.read_text()


@pytest.mark.slow
def test_a_sensors_law_is_asked_for_and_several_are_put_side_by_side(by_law):
    (uniform, foundation), page = by_law
    assert (uniform["law"], foundation["law"]) == ("uniform", "foundation")
    # Spheres and free tilts are pressed otherwise.
    assert uniform["mujoco"] != foundation["mujoco"]
    assert "fast, foundation" in page


@pytest.mark.slow
def test_the_command_prints_json_and_rewrites_its_tables(by_law, tmp_path, monkeypatch):
    """Of one sensor, whose presses are those of two laws: measuring takes long."""
    measured = json.loads(json.dumps(by_law[0][0]).replace("null", "NaN"))
    monkeypatch.setattr("mjtactile.recognition.evaluation.recognisers.evaluate", lambda *_, **__: measured)
    page = tmp_path / "page.md"
    page.write_text("before\n<!-- bench evaluate -->\nold\n<!-- end -->\nafter\n")
    done = CliRunner().invoke(app, ["evaluate", "--presses", "20", "--fidelity", "fast", "--json", "--page", str(page)])
    assert done.exit_code == 0, done.output
    assert json.loads(done.stdout) == by_law[0][0]
    assert by_law[0][0]["presses"] == 20
    assert "old" not in page.read_text()
    assert page.read_text().startswith("before\n")
    assert page.read_text().endswith("after\n")
