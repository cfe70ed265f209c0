import math
from decimal import Decimal
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mjtactile.errors import UnitError
from mjtactile.units import finite_number, is_whole, parse_force, parse_millimetres, real_numbers


@pytest.mark.parametrize(
    ("text", "newtons"),
    [("100gf", 0.980665), ("0.98N", 0.98), ("980 mN", 0.98), (" 1e2 GF ", 0.980665), ("+5gf", 0.04903325)],
)
def test_forces_with_units(text, newtons):
    assert parse_force(text) == pytest.approx(newtons, rel=1e-15)


@pytest.mark.parametrize("text", ["", "gf", "5", "5kg", "1.2.3gf", "five gf", "5 gf N", "1MN"])
def test_a_force_without_number_or_unit_shows_how_to_write_it(text):
    with pytest.raises(UnitError, match="with unit gf, N or mN; expected for example 100gf"):
        parse_force(text)


@pytest.mark.parametrize("text", ["-5gf", "0gf", "1e999N"])
def test_a_force_that_does_not_press_is_refused(text):
    with pytest.raises(UnitError, match="positive"):
        parse_force(text)


@given(st.floats(-100, 100), st.floats(-100, 100))
def test_millimetres_become_metres(x, y):
    assert parse_millimetres("shift", f"{x!r},{y!r}") == (x * 1e-3, y * 1e-3)


@pytest.mark.parametrize("text", ["1", "1,2,3", "a,b", "", "nan,0", "inf,1"])
def test_anything_but_two_numbers_is_refused(text):
    with pytest.raises(UnitError, match="shift"):
        parse_millimetres("shift", text)


@pytest.mark.parametrize("value", [1, 1.0, np.int8(1), np.float32(1), np.array(1.0)])
def test_numbers_are_those_of_python_and_numpy(value):
    assert finite_number(value) == 1.0
    assert type(finite_number(value)) is float
    assert is_whole(value) == isinstance(value, int | np.integer)


@pytest.mark.parametrize(
    "value", [True, np.bool_(True), "1", b"1", None, 1j, np.complex128(1j), [], np.ones(2), math.inf, 10**400]
)
def test_everything_else_is_no_finite_number(value):
    assert math.isnan(finite_number(value))
    assert is_whole(value) == (value == 10**400 if isinstance(value, int) else False)


@pytest.mark.parametrize("values", [1, [1, 2.5], np.ones((2, 3)), [Fraction(1, 2), Decimal(2)], [10**30], [math.nan]])
def test_arrays_are_of_real_numbers(values):
    numbers = real_numbers(values)
    assert numbers is not None
    np.testing.assert_array_equal(numbers.astype(float), np.asarray(values, dtype=float))


@pytest.mark.parametrize(
    "values", [None, [1.0, None], "1", ["1"], [1j], np.ones(1, complex), [[1], [1, 2]], {}, [10**400]]
)
def test_everything_else_is_no_array_of_them(values):
    assert real_numbers(values) is None
