"""The instruction sets that the core is compiled for, one after the other."""

import pytest

import mjtactile
from mjtactile import _native as native

#: From the widest to none.
SETS = ("avx512", "avx2", "plain")


@pytest.fixture(params=SETS)
def instruction_set(request):
    before = native.instruction_set()
    try:
        native.use_instruction_set(request.param)
    except mjtactile.NativeError:
        pytest.skip(f"this processor has no {request.param}")
    yield request.param
    native.use_instruction_set(before)
