"""Influence matrices that several tests share: named meshes from the cache, and one small sheet in double precision."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from hypothesis import settings
from small_pads import COARSE, LAYERED_PAD, in_double_precision
from threadpoolctl import threadpool_limits

from mjtactile.fidelity import Fidelity
from mjtactile.influence.cache import influence_matrices
from mjtactile.influence.matrices import InfluenceMatrices
from mjtactile.pad import Pad

# The same examples in every run, so that what fails was changed. New ones: pytest --hypothesis-profile default.
settings.register_profile("fixed", derandomize=True)
settings.load_profile("fixed")


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Files with slow tests first: of two processes, none is left alone with one at the end."""
    slow = {item.path for item in items if item.get_closest_marker("slow")}
    items.sort(key=lambda item: item.path not in slow)


@pytest.fixture(scope="session", autouse=True)
def _one_thread_per_product() -> Iterator[None]:
    """Matrices are small here; threads that wait for each other on a busy machine take ten times as long."""
    with threadpool_limits(limits=1, user_api="blas"):
        yield


@pytest.fixture(scope="session")
def draft() -> InfluenceMatrices:
    return influence_matrices(fidelity=Fidelity(mesh="draft"), progress=False)


@pytest.fixture(scope="session")
def default_influence() -> InfluenceMatrices:
    return influence_matrices(fidelity=Fidelity(mesh="default"), progress=False)


@pytest.fixture(scope="session")
def fine() -> InfluenceMatrices:
    return influence_matrices(fidelity=Fidelity(mesh="fine"), progress=False)


@pytest.fixture(scope="session")
def coarse_square() -> InfluenceMatrices:
    """The paper's pad on a coarse mesh, in double precision."""
    return in_double_precision(Pad(), COARSE)


@pytest.fixture(scope="session")
def layered() -> InfluenceMatrices:
    """An oblong layered pad with lopsided taxels on a coarse mesh, in double precision."""
    return in_double_precision(LAYERED_PAD, COARSE)
