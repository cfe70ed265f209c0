"""Environments of other packages, each with the MuJoCo that the package runs on, and mjtactile of the working tree.

    python tests/soak/client_venvs.py    # makes all of them

torch is left out, which reading a pad does not need.
"""

from __future__ import annotations

import subprocess
import sys
import tomllib
import venv
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
#: Where they are made, beside what the soak leaves.
FOLDER = ROOT / "build" / "soak"
#: What mjtactile needs, and for drawing.
_NEEDS = (*tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["dependencies"], "matplotlib")
#: Packages by environment, with the newest MuJoCo that their environments run on.
VENVS = {
    "gymnasium-robotics": ("gymnasium-robotics==1.4.2", "gymnasium[mujoco]", "mujoco==3.10.0"),
    "robosuite": ("robosuite==1.5.2", "mujoco==3.8.0"),
    "dm-control": ("dm-control==1.0.50", "mujoco==3.17.0"),
}


def wheel(folder: Path) -> Path:
    """A wheel of the working tree, made where it is missing or older."""
    wheels = folder / "wheels"
    sources = [path for part in ("mjtactile", "native") for path in (ROOT / part).rglob("*") if path.is_file()]
    newest = max(path.stat().st_mtime for path in sources if "__pycache__" not in path.parts)
    built = sorted(wheels.glob("mjtactile-*.whl"))
    if not built or built[0].stat().st_mtime < newest:
        # Without isolation pip uses what `make install-dev` has compiled.
        pip = [sys.executable, "-m", "pip", "--quiet", "wheel", "--no-deps", "--no-build-isolation"]
        subprocess.run([*pip, "-w", str(wheels), str(ROOT)], check=True)
        built = sorted(wheels.glob("mjtactile-*.whl"))
    return built[0]


def install(name: str, folder: Path) -> Path:
    """Python of the environment of a package, made where it is missing; mjtactile in it is the working tree's."""
    home, ours = folder / name, wheel(folder)
    python = home / "bin" / "python"
    pip = [str(python), "-m", "pip", "--disable-pip-version-check", "--quiet", "install"]
    if not (home / "installed").is_file():
        # Links, not copies: a copy of Python cannot be run ("text file busy") while a process that the other thread has
        # just forked still holds it open for writing.
        venv.create(home, with_pip=True, clear=True, symlinks=True)
        subprocess.run([*pip, *VENVS[name], *_NEEDS], check=True)
        (home / "installed").touch()
    marker = home / "installed-mjtactile"
    if not marker.is_file() or marker.stat().st_mtime < ours.stat().st_mtime:
        subprocess.run([*pip, "--no-deps", "--force-reinstall", str(ours)], check=True)
        marker.touch()
    return python


if __name__ == "__main__":
    wheel(FOLDER)
    with ThreadPoolExecutor(max_workers=2) as pool:
        list(pool.map(lambda package: install(package, FOLDER), VENVS))
