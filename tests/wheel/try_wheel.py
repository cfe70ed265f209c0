"""A wheel as a user gets it: fresh environments without a compiler, outside the checkout, one for each MuJoCo.

    python tests/wheel/try_wheel.py dist/mjtactile-*.whl --mujoco 3.3.7 4.0.0 newest

Needs nothing but Python. In each environment: pip installs the wheel, `mjtactile press` reads, `mjtactile doctor` finds
nothing wrong, and first_reading.py runs. In the first, `mjtactile press` builds the table of the default fidelity and
says so. Downloads are not counted.
"""

from __future__ import annotations

import argparse
import json
import os
import shutil
import subprocess
import sys
import tempfile
import time
import venv
from pathlib import Path

#: Sizes [bytes] and times [s] that a release keeps to. What pip compiles from the files is not counted as installed.
MOST_WHEEL, MOST_INSTALLED, MOST_INSTALL_TIME, MOST_FIRST_READING = 15e6, 300e6, 60.0, 60.0
#: Packages of a fresh environment, and what only extras bring.
TOOLS = {"pip", "setuptools", "pkg_resources", "_distutils_hack"}
EXTRAS = ("torch", "pyarrow", "matplotlib", "PIL", "gymnasium", "ray", "stable_baselines3")
PRESS = ("press", "star", "--fidelity", "fast", "--force", "100gf", "--tilt", "15", "--json")


def main() -> None:
    """Try the wheel with each MuJoCo and print what was measured."""
    parser = argparse.ArgumentParser(description="Try a wheel as a user gets it.")
    parser.add_argument("wheel", type=Path)
    parser.add_argument("--mujoco", nargs="+", default=["newest"])
    arguments = parser.parse_args()
    wheel = arguments.wheel.resolve()
    check(wheel.stat().st_size, MOST_WHEEL, "the wheel's size [bytes]")
    print(f"wheel {wheel.stat().st_size / 1e6:.1f} MB: {wheel.name}")
    tried = set()
    for version in arguments.mujoco:
        with tempfile.TemporaryDirectory() as folder:
            line, installed = try_with(version, wheel, Path(folder), tried)
        tried.add(installed)
        print(line, flush=True)


class Environment:
    """A fresh virtual environment without a compiler, and commands that run in it.

    Args:
        folder: empty; it becomes the home of what runs.
        version: of MuJoCo, or "newest", for messages and for pip.
    """

    def __init__(self, folder: Path, version: str) -> None:
        self.folder, self.version = folder, version
        self.mujoco = "mujoco" if version == "newest" else f"mujoco=={version}"
        self.path = folder / "environment"
        self.cache = folder / "cache"
        venv.create(self.path, with_pip=True)
        commands = self.path / "bin"
        self.python, self.mjtactile = str(commands / "python"), str(commands / "mjtactile")
        self.pip = (self.python, "-m", "pip", "--disable-pip-version-check", "--quiet")
        self.variables = {"PATH": str(commands), "HOME": str(folder), "MJTACTILE_CACHE": str(self.cache)}
        kept = ("PIP_", "SSL_", "OMP_", "LC_")
        self.variables |= {name: os.environ[name] for name in os.environ if name.startswith(kept)}
        for compiler in ("cc", "gcc", "g++", "c++", "clang", "clang++"):
            assert shutil.which(compiler, path=self.variables["PATH"]) is None, compiler

    def run(self, *command: str) -> subprocess.CompletedProcess[str]:
        """Run a command and return its output; end the program with that output when the command fails."""
        done = subprocess.run(command, cwd=self.folder, env=self.variables, capture_output=True, text=True, check=False)
        if done.returncode:
            sys.exit(f"with MuJoCo {self.version}: {' '.join(command)}\n{done.stdout}\n{done.stderr}")
        return done

    def download(self, wheel: Path) -> str:
        """Download the wheel's dependencies into `downloads`; return the version of MuJoCo among them."""
        # pip's own settings may stand in the home of whoever calls.
        variables = self.variables | {"HOME": os.environ["HOME"]}
        download = (*self.pip, "download", "--only-binary=:all:", "--dest", "downloads", str(wheel), self.mujoco)
        subprocess.run(download, cwd=self.folder, env=variables, check=True)
        return next((self.folder / "downloads").glob("mujoco-*.whl")).name.split("-")[1]

    def install(self, wheel: Path) -> None:
        """Install the wheel and its dependencies from `downloads` alone."""
        self.run(*self.pip, "install", "--no-index", "--find-links", "downloads", str(wheel), self.mujoco)


def try_with(version: str, wheel: Path, folder: Path, tried: set[str]) -> tuple[str, str]:
    """Install the wheel with one MuJoCo and use it.

    Args:
        version: of MuJoCo, or "newest".
        wheel: file.
        folder: empty.
        tried: versions of MuJoCo that need not be tried again.

    Returns:
        A line on what was found, and the version of MuJoCo.
    """
    environment = Environment(folder, version)
    name = environment.download(wheel)
    if name in tried:
        return f"MuJoCo {name} is the newest, too", name
    start = time.perf_counter()
    environment.install(wheel)
    install_time = time.perf_counter() - start
    try_press(environment)
    first_reading_time = time.perf_counter() - start
    said = try_the_rest(environment)
    if not tried:
        try_default_fidelity(environment)
    files, compiled = installed_size(environment.path)
    check(files, MOST_INSTALLED, "the size of the core install [bytes]")
    check(install_time, MOST_INSTALL_TIME, "the time of the core install [s]")
    check(first_reading_time, MOST_FIRST_READING, "the time from wheel to first reading [s]")
    line = (
        f"{said.strip()}; installed {files / 1e6:.0f} MB and {compiled / 1e6:.0f} MB of bytecode in "
        f"{install_time:.0f} s, first reading after {first_reading_time:.0f} s"
    )
    return line, name


def try_press(environment: Environment) -> None:
    """Check that a press at fidelity "fast" reads right, and that no table is built for it."""
    reading = json.loads(environment.run(environment.mjtactile, *PRESS).stdout)
    assert abs(reading["force_error_relative"]) < 1e-3, reading
    assert len(reading["peak_reading_Pa"]) == 4, reading
    assert min(reading["peak_reading_Pa"]) > 1e3, reading
    assert not environment.cache.exists(), "a table was built"


def try_the_rest(environment: Environment) -> str:
    """Check that extras are absent, that first_reading.py runs, and that doctor finds nothing wrong.

    Returns:
        What first_reading.py prints.
    """
    for module in EXTRAS:
        found = f"import sys; from importlib.util import find_spec; sys.exit(find_spec({module!r}) is not None)"
        environment.run(environment.python, "-c", found)
    said = environment.run(environment.python, str(Path(__file__).with_name("first_reading.py"))).stdout
    environment.run(environment.mjtactile, "doctor")
    return said


def try_default_fidelity(environment: Environment) -> None:
    """Check that the first press at the default fidelity builds its table and says so; print how long it took."""
    start = time.perf_counter()
    told = environment.run(environment.mjtactile, "press", "star", "--json").stderr
    assert told.startswith("mjtactile: building influence matrices at fidelity balanced"), told
    print(f"the first press at the default fidelity builds its table and says so: {time.perf_counter() - start:.0f} s")


def installed_size(environment: Path) -> tuple[int, int]:
    """Bytes of the packages in an environment but for its tools: files as shipped, and bytecode made of them."""
    files = compiled = 0
    (packages,) = environment.glob("lib/python3*/site-packages")
    for path in packages.rglob("*"):
        if path.is_file() and path.relative_to(packages).parts[0].split("-")[0] not in TOOLS:
            if path.suffix == ".pyc":
                compiled += path.stat().st_size
            else:
                files += path.stat().st_size
    return files, compiled


def check(value: float, most: float, what: str) -> None:
    """End here when something is more than a release may have."""
    if value > most:
        sys.exit(f"{what} is {value:.4g}, more than {most:.4g}.")


if __name__ == "__main__":
    main()
