"""Registers the sensor plugin when both mjtactile and MuJoCo are imported, and the environments with gymnasium.

MuJoCo from 4.0 on looks for plugins itself (the entry point group "mujoco.plugins"); before that, this does. gymnasium
looks for none since its version 1.0.
"""

from __future__ import annotations

import sys
import warnings

from mjtactile.plugin.import_hook import after_import


def install() -> None:
    """Register now what can be, the rest right after the import of the package it is for."""
    after_import("mujoco", _register_or_warn)
    after_import("gymnasium", _register_environments)


def _register_or_warn() -> None:
    """MuJoCo's own import must not fail because of this plugin."""
    from mjtactile.errors import MjTactileError
    from mjtactile.plugin.registration import PLUGIN, ensure_registered

    try:
        ensure_registered()
    except MjTactileError as error:
        warnings.warn(f"the sensor plugin {PLUGIN} is not available: {error}", RuntimeWarning, stacklevel=2)


def _register_environments() -> None:
    # The package registers them itself; it may be what imports gymnasium.
    if "mjtactile.envs" in sys.modules:
        return
    import mjtactile.envs  # noqa: F401
