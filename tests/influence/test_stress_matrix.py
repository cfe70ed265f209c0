"""Stress matrices: runs of columns, factors, and what is stored of them."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mjtactile.influence.stress_matrix import ClassForces, StressMatrix, read_matrix, stored_matrix


def forces_at(columns: list[int], count: int, batch: int = 1) -> ClassForces:
    values = np.zeros((batch, count))
    values[:, columns] = np.random.default_rng(0).uniform(0.5, 1.0, (batch, len(columns)))
    return ClassForces(values)


@settings(max_examples=100, deadline=None)
@given(st.sets(st.integers(0, 199)), st.integers(1, 3))
def test_runs_hold_every_force_once_and_start_and_end_with_one(columns, batch):
    forces = forces_at(sorted(columns), 200, batch)
    covered = [column for run in forces.runs for column in range(run.start, run.stop)]
    assert len(set(covered)) == len(covered)
    assert columns <= set(covered)
    assert all({run.start, run.stop - 1} <= columns for run in forces.runs)


def test_a_wide_gap_is_left_out_and_a_narrow_one_is_not():
    assert forces_at([3, 4, 8, 150], 200).runs == [slice(3, 9), slice(150, 151)]


@pytest.mark.parametrize("columns", [[], [0], [199], [0, 1, 2, 50, 51, 199], list(range(200))], ids=len)
@pytest.mark.parametrize("rank", [None, 7])
def test_product_is_the_plain_one(columns, rank):
    random = np.random.default_rng(1)
    factors = (
        (random.standard_normal((200, 30)),)
        if rank is None
        else (random.standard_normal((200, rank)), random.standard_normal((rank, 30)))
    )
    forces = forces_at(columns, 200, batch=2)
    expected = forces.values @ np.linalg.multi_dot([*factors, np.eye(30)])
    np.testing.assert_allclose(StressMatrix(factors).times(forces), expected, rtol=1e-12, atol=1e-12)


@pytest.mark.parametrize("precision", ["float64", "float32", "float16", "int8"])
@pytest.mark.parametrize("count", [1, 2])
def test_stored_matrices_come_back(precision, count):
    random = np.random.default_rng(2)
    factors = tuple(random.standard_normal(shape) for shape in ((20, 30), (30, 40))[:count])
    tables = stored_matrix("deviatoric ++ 2", factors, precision)
    names = {"deviatoric ++ 2"} if count == 1 else {"deviatoric ++ 2 left", "deviatoric ++ 2 right"}
    assert set(tables) == (names | {f"{n} scale" for n in names} if precision in ("float16", "int8") else names)
    stored = {name: "float16" if precision == "int8" and "left" in name else precision for name in names}
    assert {name: tables[name].dtype for name in names} == {name: np.dtype(kind) for name, kind in stored.items()}
    back = read_matrix(tables, "deviatoric ++ 2").factors
    assert {factor.dtype for factor in back} == {np.dtype("float64" if precision == "float64" else "float32")}
    rounding = {"float64": 0.0, "float32": 1e-7, "float16": 5e-4, "int8": 5e-4}[precision]
    for number, (factor, original) in enumerate(zip(back, factors, strict=True)):
        one_byte = precision == "int8" and number == count - 1
        largest = np.abs(original).max(axis=1, keepdims=True) if one_byte else 0.0
        assert (np.abs(factor - original) <= rounding * np.abs(original) + largest / 253).all()


def test_matrix_that_is_not_there_is_missed_by_name():
    with pytest.raises(KeyError, match="mean -- 1 left"):
        read_matrix({}, "mean -- 1")
