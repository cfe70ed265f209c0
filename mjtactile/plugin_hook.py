"""Registers the sensor plugin when both mjtactile and MuJoCo are imported, in whichever order.

MuJoCo from 4.0 on looks for plugins itself (the entry point group "mujoco.plugins"); before that, this does.
"""

from __future__ import annotations

import importlib.abc
import importlib.machinery
import importlib.util
import sys
import warnings
from collections.abc import Sequence
from types import ModuleType


def install() -> None:
    """Register the plugin now if MuJoCo is imported, otherwise right after it will be."""
    if "mujoco" in sys.modules:
        _register_or_warn()
    elif not any(isinstance(finder, _AfterMujoco) for finder in sys.meta_path):
        sys.meta_path.insert(0, _AfterMujoco())


class _AfterMujoco(importlib.abc.MetaPathFinder):
    """Registers the plugin once MuJoCo has been imported: before 4.0 it does not look for plugins itself."""

    def find_spec(
        self, fullname: str, path: Sequence[str] | None, target: ModuleType | None = None
    ) -> importlib.machinery.ModuleSpec | None:
        if fullname != "mujoco":
            return None
        sys.meta_path.remove(self)
        spec = importlib.util.find_spec(fullname)
        if spec is not None and spec.loader is not None:
            execute = spec.loader.exec_module

            def exec_module(module: ModuleType) -> None:
                execute(module)
                _register_or_warn()

            spec.loader.exec_module = exec_module
        return spec


def _register_or_warn() -> None:
    """MuJoCo's own import must not fail because of this plugin."""
    from mjtactile.errors import MjTactileError
    from mjtactile.plugin import PLUGIN, ensure_registered

    try:
        ensure_registered()
    except MjTactileError as error:
        warnings.warn(f"the sensor plugin {PLUGIN} is not available: {error}", RuntimeWarning, stacklevel=2)
