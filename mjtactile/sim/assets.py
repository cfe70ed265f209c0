"""Paths of models, scenes and benchmark cases: inside an installed package, or beside it in a checkout."""

from __future__ import annotations

from pathlib import Path

from mjtactile.errors import SceneError

_PACKAGE = Path(__file__).resolve().parents[1]
_ROOT = _PACKAGE / "assets" if (_PACKAGE / "assets").is_dir() else _PACKAGE.parent
_FOLDERS = ("models", "scenes")
_CASES = "benchmarks"


def asset_path(name: str) -> Path:
    """Absolute path of a model, scene or benchmark case by its name, such as "scenes/press.xml".

    Raises:
        SceneError: there is no such file; the message lists the existing ones.
    """
    is_cases = Path(name).parent.as_posix() == _CASES and (_ROOT / name).is_file()
    if name not in (available := available_assets()) and not is_cases:
        raise SceneError(f"asset '{name}' does not exist. Available: {available}.")
    return _ROOT / name


def available_assets() -> list[str]:
    """Names of all models and scenes."""
    found = (path for folder in _FOLDERS for path in (_ROOT / folder).rglob("*.xml"))
    return sorted(path.relative_to(_ROOT).as_posix() for path in found)
