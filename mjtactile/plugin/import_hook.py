"""Registers the sensor plugin when both mjtactile and MuJoCo are imported, and the environments with gymnasium.

MuJoCo from 4.0 on finds plugins itself (entry point group "mujoco.plugins"); this module does it for older versions.
gymnasium has no such mechanism since its version 1.0. The packages may be imported in any order; none is imported here.
"""

from __future__ import annotations

import importlib.abc
import importlib.machinery
import sys
import warnings
from collections.abc import Callable, Sequence
from types import ModuleType

#: Name of the package that registers environments, which this package must not import directly.
_ENVIRONMENTS = "mjtactile.envs"


def after_import(package: str, action: Callable[[], None]) -> None:
    """Call a function right after a package is imported, or now if it has been imported.

    If a function is already waiting for the package, the call has no effect.
    """
    if package in sys.modules:
        action()
    elif not any(isinstance(finder, _After) and finder.package == package for finder in sys.meta_path):
        sys.meta_path.insert(0, _After(package, action))


class _After(importlib.abc.MetaPathFinder):
    """Import hook that waits for one package and then calls a function, once."""

    def __init__(self, package: str, action: Callable[[], None]) -> None:
        self.package, self._action = package, action
        self._wrapped: list[importlib.abc.Loader] = []

    def find_spec(
        self, fullname: str, path: Sequence[str] | None, target: ModuleType | None = None
    ) -> importlib.machinery.ModuleSpec | None:
        if fullname != self.package:
            return None
        others = [finder for finder in sys.meta_path if finder is not self and hasattr(finder, "find_spec")]
        specs = (finder.find_spec(fullname, path, target) for finder in others)
        spec = next((found for found in specs if found is not None), None)
        # One loader may serve several modules, or the same one whenever it is asked for.
        if spec is not None and spec.loader is not None and not any(spec.loader is one for one in self._wrapped):
            self._wrapped.append(spec.loader)
            execute = spec.loader.exec_module

            def exec_module(module: ModuleType) -> None:
                # Whether a package exists is often asked before it is imported, so the hook waits until now.
                execute(module)
                if module.__name__ == self.package and self in sys.meta_path:
                    sys.meta_path.remove(self)
                    self._action()

            spec.loader.exec_module = exec_module
        return spec


def install() -> None:
    """Register with MuJoCo and gymnasium now if they are imported, otherwise right after their import."""
    after_import("mujoco", _register_or_warn)
    after_import("gymnasium", _register_environments)


def _register_or_warn() -> None:
    """Register the plugin; on failure warn, so that the import of MuJoCo does not fail."""
    from mjtactile.errors import MjTactileError
    from mjtactile.pad_names import PLUGIN
    from mjtactile.plugin.registration import ensure_registered

    try:
        ensure_registered()
    except MjTactileError as error:
        warnings.warn(f"the sensor plugin {PLUGIN} is not available: {error}", RuntimeWarning, stacklevel=2)


def _register_environments() -> None:
    # mjtactile.envs registers them itself; it may be the package that imports gymnasium.
    if _ENVIRONMENTS not in sys.modules:
        importlib.import_module(_ENVIRONMENTS)
