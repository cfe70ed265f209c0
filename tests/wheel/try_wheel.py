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
    environment = folder / "environment"
    venv.create(environment, with_pip=True)
    commands = environment / "bin"
    variables = {"PATH": str(commands), "HOME": str(folder), "MJTACTILE_CACHE": str(folder / "cache")}
    variables |= {name: os.environ[name] for name in os.environ if name.startswith(("PIP_", "SSL_", "OMP_", "LC_"))}
    for compiler in ("cc", "gcc", "g++", "c++", "clang", "clang++"):
        assert shutil.which(compiler, path=variables["PATH"]) is None, compiler

    def tell(*command: str) -> subprocess.CompletedProcess[str]:
        done = subprocess.run(command, cwd=folder, env=variables, capture_output=True, text=True, check=False)
        if done.returncode:
            sys.exit(f"with MuJoCo {version}: {' '.join(command)}\n{done.stdout}\n{done.stderr}")
        return done

    def run(*command: str) -> str:
        return tell(*command).stdout

    pip = (str(commands / "python"), "-m", "pip", "--disable-pip-version-check", "--quiet")
    mujoco = "mujoco" if version == "newest" else f"mujoco=={version}"
    # pip's own settings may stand in the home of whoever calls.
    settings = {"HOME": os.environ["HOME"]}
    download = (*pip, "download", "--only-binary=:all:", "--dest", "downloads", str(wheel), mujoco)
    subprocess.run(download, cwd=folder, env=variables | settings, check=True)
    name = next((folder / "downloads").glob("mujoco-*.whl")).name.split("-")[1]
    if name in tried:
        return f"MuJoCo {name} is the newest, too", name

    start = time.perf_counter()
    run(*pip, "install", "--no-index", "--find-links", "downloads", str(wheel), mujoco)
    install_time = time.perf_counter() - start
    reading = json.loads(run(str(commands / "mjtactile"), *PRESS))
    first_reading_time = time.perf_counter() - start
    assert abs(reading["force_error_relative"]) < 1e-3, reading
    assert len(reading["peak_reading_Pa"]) == 4, reading
    assert min(reading["peak_reading_Pa"]) > 1e3, reading
    assert not (folder / "cache").exists(), "a table was built"
    for module in EXTRAS:
        found = f"import sys; from importlib.util import find_spec; sys.exit(find_spec({module!r}) is not None)"
        run(str(commands / "python"), "-c", found)
    said = run(str(commands / "python"), str(Path(__file__).with_name("first_reading.py")))
    run(str(commands / "mjtactile"), "doctor")

    if not tried:
        start = time.perf_counter()
        told = tell(str(commands / "mjtactile"), "press", "star", "--json").stderr
        assert told.startswith("mjtactile: building influence matrices at fidelity balanced"), told
        print(
            f"the first press at the default fidelity builds its table and says so: {time.perf_counter() - start:.0f} s"
        )

    files, compiled = installed_size(environment)
    check(files, MOST_INSTALLED, "the size of the core install [bytes]")
    check(install_time, MOST_INSTALL_TIME, "the time of the core install [s]")
    check(first_reading_time, MOST_FIRST_READING, "the time from wheel to first reading [s]")
    line = (
        f"{said.strip()}; installed {files / 1e6:.0f} MB and {compiled / 1e6:.0f} MB of bytecode in "
        f"{install_time:.0f} s, first reading after {first_reading_time:.0f} s"
    )
    return line, name


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
