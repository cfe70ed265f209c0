"""Registers the sensor plugin when both mjtactile and MuJoCo are imported, and the environments with gymnasium.

MuJoCo from 4.0 on looks for plugins itself (the entry point group "mujoco.plugins"); before that, this does. gymnasium
looks for none since its version 1.0. Whichever of the two packages comes first, nothing is imported for it.
"""

from __future__ import annotations

import importlib.abc
import importlib.machinery
import importlib.util
import sys
import warnings
from collections.abc import Callable, Sequence
from types import ModuleType

#: The package that registers environments, by name: this one stands below it.
_ENVIRONMENTS = "mjtactile.envs"


def after_import(package: str, action: Callable[[], None]) -> None:
    """Call a function right after a package is imported, or now if it is already; a second request changes nothing."""
    if package in sys.modules:
        action()
    elif not any(isinstance(finder, _After) and finder.package == package for finder in sys.meta_path):
        sys.meta_path.insert(0, _After(package, action))


class _After(importlib.abc.MetaPathFinder):
    """Import hook that waits for one package and then calls a function, once."""

    def __init__(self, package: str, action: Callable[[], None]) -> None:
        self.package, self._action = package, action

    def find_spec(
        self, fullname: str, path: Sequence[str] | None, target: ModuleType | None = None
    ) -> importlib.machinery.ModuleSpec | None:
        if fullname != self.package:
            return None
        sys.meta_path.remove(self)
        spec = importlib.util.find_spec(fullname)
        if spec is not None and spec.loader is not None:
            execute, action = spec.loader.exec_module, self._action

            def exec_module(module: ModuleType) -> None:
                execute(module)
                action()

            spec.loader.exec_module = exec_module
        return spec


def install() -> None:
    """Register with the packages that are imported already, and with the others right after their import."""
    after_import("mujoco", _register_or_warn)
    after_import("gymnasium", _register_environments)


def _register_or_warn() -> None:
    """MuJoCo's own import must not fail because of this plugin."""
    from mjtactile.errors import MjTactileError
    from mjtactile.pad_names import PLUGIN
    from mjtactile.plugin.registration import ensure_registered

    try:
        ensure_registered()
    except MjTactileError as error:
        warnings.warn(f"the sensor plugin {PLUGIN} is not available: {error}", RuntimeWarning, stacklevel=2)


def _register_environments() -> None:
    # The package registers them itself; it may be what imports gymnasium.
    if _ENVIRONMENTS not in sys.modules:
        importlib.import_module(_ENVIRONMENTS)
