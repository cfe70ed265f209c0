"""The study's networks: RPROP as published, side by side as alone, samples as the paper counts them."""

import itertools

import numpy as np
import pytest
import torch

from mjtactile.contact.contact_load import contact_load
from mjtactile.contact.footprint import Footprint
from mjtactile.experiments.study import force, protocol, shape
from mjtactile.experiments.study.networks import GROW, SHRINK, NetworkDesign, Training, _forward, train
from mjtactile.experiments.study.presses import (
    force_along,
    law_difference,
    oblique_readings,
    punch_readings,
    unit_vectors,
)
from mjtactile.experiments.study.wide import WideGradient
from mjtactile.geometry.outlines import INDENTER_NAMES, ellipse

INPUTS = np.array([[0.0, 0.0], [0.0, 1.0], [1.0, 0.0], [1.0, 1.0]])
EXCLUSIVE_OR = np.array([[0.0], [1.0], [1.0], [0.0]])


def rprop_by_hand(design, inputs, targets, seed, iterations):
    """One hidden layer of sigmoids, linear output: RPROP without weight backtracking, written from the paper."""
    drawn = np.random.default_rng(seed)
    sizes = (inputs.shape[1], *design.hidden, targets.shape[1])
    layers = [drawn.uniform(-1, 1, (a + 1, b)) / np.sqrt(a) for a, b in itertools.pairwise(sizes)]
    steps = [np.full(layer.shape, design.first_step) for layer in layers]
    before = [np.zeros(layer.shape) for layer in layers]
    one = np.ones((len(inputs), 1))
    for _ in range(iterations):
        hidden = 1.0 / (1.0 + np.exp(-np.hstack([inputs, one]) @ layers[0]))
        error = np.hstack([hidden, one]) @ layers[1] - targets
        back = error @ layers[1][:-1].T * hidden * (1.0 - hidden)
        gradients = [np.hstack([inputs, one]).T @ back, np.hstack([hidden, one]).T @ error]
        for k, gradient in enumerate(gradients):
            turn = np.sign(gradient * before[k])
            steps[k] = np.clip(
                steps[k] * np.where(turn > 0, GROW, np.where(turn < 0, SHRINK, 1.0)), design.smallest_step, 50.0
            )
            gradient = np.where(turn < 0, 0.0, gradient)
            layers[k] = layers[k] - np.sign(gradient) * steps[k]
            before[k] = gradient
    hidden = 1.0 / (1.0 + np.exp(-np.hstack([inputs, one]) @ layers[0]))
    return np.hstack([hidden, one]) @ layers[1]


def test_learning_is_rprop_as_published():
    design = NetworkDesign(hidden=(5,))
    # Ten iterations: rounding has not yet turned a sign, and the last weights are the best.
    by_hand = rprop_by_hand(design, INPUTS, EXCLUSIVE_OR, 3, 10)
    learnt = train(design, INPUTS, EXCLUSIVE_OR, Training(seeds=[3], iterations=10, precision=torch.float64))
    np.testing.assert_allclose(learnt(INPUTS)[0], by_hand, rtol=1e-10, atol=1e-12)
    assert learnt.error[0] == pytest.approx(np.sqrt(np.mean((by_hand - EXCLUSIVE_OR) ** 2)), rel=1e-9)


def test_the_gradient_written_out_is_the_one_differentiated():
    drawn = torch.Generator().manual_seed(0)

    def leaf(*shape):
        return torch.randn(*shape, generator=drawn, dtype=torch.float64).requires_grad_()

    weights, biases = [leaf(3, 4, 6), leaf(3, 6, 1)], [leaf(3, 1, 6), leaf(3, 1, 1)]
    inputs, targets = (torch.randn(20, n, generator=drawn, dtype=torch.float64) for n in (4, 1))
    error = WideGradient(inputs, targets, weights, biases).error()
    written = [torch.as_tensor(parameter.grad).clone() for parameter in (*weights, *biases)]
    for parameter in (*weights, *biases):
        parameter.grad = None
    expected = ((_forward(NetworkDesign(hidden=(6,)), weights, biases, inputs) - targets) ** 2).mean(dim=(1, 2))
    expected.sum().backward()
    torch.testing.assert_close(error, expected.detach())
    for parameter, gradient in zip((*weights, *biases), written, strict=True):
        torch.testing.assert_close(gradient * 2 / 20, parameter.grad)  # the factor that RPROP does not see


@pytest.mark.parametrize("output", ["linear", "sigmoid"])
@pytest.mark.parametrize("activation", ["tanh", "sigmoid"])
def test_networks_learn_what_a_line_cannot(output, activation):
    design = NetworkDesign(hidden=(8,), output=output, activation=activation)
    learnt = train(design, INPUTS, EXCLUSIVE_OR, Training(seeds=range(4), iterations=500, tolerance=1e-3))
    assert np.median(learnt.error) < 1e-2
    assert learnt(INPUTS).shape == (4, 4, 1)


def test_a_network_learns_beside_others_as_it_does_alone():
    design = NetworkDesign(hidden=(6, 4), initial="half")
    exact = {"iterations": 40, "precision": torch.float64}
    together = train(design, INPUTS, EXCLUSIVE_OR, Training(seeds=(1, 2, 3), **exact))
    alone = train(design, INPUTS, EXCLUSIVE_OR, Training(seeds=(2,), **exact))
    np.testing.assert_allclose(together(INPUTS)[1], alone(INPUTS)[0], rtol=1e-9, atol=1e-12)
    again = train(design, INPUTS, EXCLUSIVE_OR, Training(seeds=(1, 2, 3), **exact))
    np.testing.assert_array_equal(again(INPUTS), together(INPUTS))


def test_a_network_that_is_content_learns_no_more():
    design = NetworkDesign(hidden=(8,))
    eager = train(design, INPUTS, EXCLUSIVE_OR, Training(seeds=range(3), iterations=1000, tolerance=0.3))
    keen = train(design, INPUTS, EXCLUSIVE_OR, Training(seeds=range(3), iterations=1000, tolerance=1e-4))
    assert (eager.error <= 0.3).all()
    assert eager.iterations < keen.iterations
    # Each is the first below its bound, not the best of those that went on.
    assert (eager.error > 0.01).all()


def test_unknown_initial_weights_are_refused():
    with pytest.raises(ValueError, match="fan-in, half, small"):
        train(NetworkDesign(hidden=(2,), initial="large"), INPUTS, EXCLUSIVE_OR, Training(seeds=[0], iterations=1))


def test_samples_are_as_many_as_the_paper_counts():
    assert len(protocol.TRAINING_ANGLES) * len(protocol.TRAINING_FORCES) == 160
    assert len(protocol.UNKNOWN_ANGLES) * len(protocol.UNKNOWN_FORCES) == 76
    assert not set(protocol.UNKNOWN_ANGLES) & set(protocol.TRAINING_ANGLES)
    assert not set(protocol.UNKNOWN_FORCES) & set(protocol.TRAINING_FORCES)


def test_shifts_go_one_pitch_far_in_eight_directions():
    shifts = np.array([protocol.shift_towards(direction) for direction in protocol.DIRECTIONS])
    np.testing.assert_allclose(np.hypot(*shifts.T), 1.25e-3)
    for name, (x, y) in zip(protocol.DIRECTIONS, shifts, strict=True):
        assert ("+x" in name) == (x > 1e-9)
        assert ("-y" in name) == (y < -1e-9)


@pytest.mark.parametrize("law", ["uniform", "elastic"])
def test_forces_are_multiples_of_one_newton(draft, law):
    footprint = Footprint.from_outline(ellipse(protocol.DISC_RADIUS, protocol.DISC_RADIUS), draft.surface)
    pressed = draft.readings(contact_load(draft, footprint, 0.3 * force_along(18.0), law=law))
    # Single precision of the stored stresses.
    np.testing.assert_allclose(pressed, 0.3 * oblique_readings(draft, law, [18.0])[0], rtol=1e-5, atol=1e-3)


def test_foundation_presses_flat_punches_as_uniform_does(draft):
    assert law_difference(draft, "foundation") < 1e-3
    assert law_difference(draft, "elastic") > 0.1


def test_directions_taught_are_unit_vectors_into_the_pad():
    vectors = unit_vectors(protocol.TRAINING_ANGLES)
    np.testing.assert_allclose(np.linalg.norm(vectors, axis=1), 1.0)
    np.testing.assert_allclose(
        np.degrees(np.arctan2(vectors[:, 0], vectors[:, 2])), protocol.TRAINING_ANGLES, atol=1e-9
    )


@pytest.mark.parametrize("scaling", shape.SCALINGS)
def test_inputs_of_unknown_punches_are_scaled_by_what_training_showed(draft, scaling):
    centred = punch_readings(draft, "uniform")
    scaled = shape._scaler(centred, scaling)
    assert scaled(centred).shape == (len(INDENTER_NAMES), 676)
    np.testing.assert_array_equal(scaled(centred[2:3]), scaled(centred)[2:3])  # no sample changes another
    if "maximum" in scaling:
        assert scaled(centred).max() == 1.0
    with pytest.raises(ValueError, match="kilopascal"):
        shape._scaler(centred, "none")


def test_the_force_study_reports_each_initialisation(draft):
    with torch.random.fork_rng():
        result = force.force_study(draft, law="uniform", layers=4, training=Training(seeds=range(3), iterations=150))
    assert np.shape(result["direction"]["recognised_deg"]) == (3, 4)
    assert len(result["magnitude"]["unknown_gf"]) == 3
    # Little learning; 2 deg and 3 gf are far from a guess (15 deg, 50 gf) and far from the end of it.
    assert np.abs(np.mean(result["direction"]["recognised_deg"], axis=0) - protocol.UNKNOWN_ANGLES).max() < 2.0
    assert np.mean(result["magnitude"]["unknown_gf"]) < 3.0
    assert result["magnitude"]["best"] == int(np.argmin(result["magnitude"]["training_gf"]))
