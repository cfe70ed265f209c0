"""Run examples and put what they print, and the pictures they draw, on their pages.

    make examples                                              # all of them, each where its package is installed
    PYTHONPATH=tests/soak python tests/examples/run_examples.py press own_pad

Each example is checked on the way: what its pads read must be what MuJoCo's contacts put on them (`check_readings.py`).
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
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from client_venvs import FOLDER, install

from mjtactile.cli.benchmarks.tables import table_on_page

ROOT = Path(__file__).resolve().parents[2]
PICTURES = ROOT / "docs" / "images" / "examples"


@dataclass(frozen=True)
class Example:
    """A script in examples/ and where it goes."""

    page: str  #: under docs/
    venv: str | None = None  #: key of `client_venvs.VENVS`; None: this environment
    pads: bool = True  #: whether it leaves `model` and `data` with pads that feel something
    slow: bool = False  #: whether it takes more than some seconds


EXAMPLES = {
    "press": Example("tutorials/press.md"),
    "pad_on_my_hand": Example("tutorials/pad-on-my-hand.md"),
    "plugin_in_xml": Example("tutorials/plugin-in-xml.md"),
    "policy": Example("tutorials/policy.md", pads=False),
    "dataset": Example("tutorials/dataset.md", pads=False),
    "own_pad": Example("tutorials/own-pad.md"),
    "curved_pad": Example("tutorials/curved-pad.md", pads=False),
    "curved_pad_in_mujoco": Example("tutorials/curved-pad.md"),
    "forces_that_add_up": Example("forces.md"),
    "mujoco_rollout": Example("clients/mujoco-rollout.md"),
    "stable_baselines3_grasp": Example("clients/stable-baselines3.md", slow=True),
    "robosuite_panda_lift": Example("clients/robosuite.md", "robosuite", slow=True),
    "dm_control_jaco": Example("clients/dm-control.md", "dm-control", slow=True),
    "gymnasium_robotics_shadow_hand": Example("clients/gymnasium-robotics.md", "gymnasium-robotics", slow=True),
}


@dataclass(frozen=True)
class Outcome:
    """What a run left."""

    printed: str  #: by the example on standard output
    pads: dict[str, dict[str, float]]  #: by pad, see `check_readings.check`
    warned: bool  #: whether it printed a `ContactWarning`
    seconds: float


def run(name: str, folder: Path) -> Outcome:
    """Run an example in a folder, where it leaves its pictures.

    Raises:
        RuntimeError: it failed; the message is what it said.
    """
    example = EXAMPLES[name]
    python = Path(sys.executable) if example.venv is None else install(example.venv, FOLDER)
    command = [str(python), str(ROOT / "tests/examples/check_readings.py"), str(ROOT / "examples" / f"{name}.py")]
    # stable-baselines3 makes a folder for its log wherever it runs: here, or in that of all temporary files.
    environment = os.environ | {"MPLBACKEND": "Agg", "OMP_NUM_THREADS": "1", "SB3_LOGDIR": str(folder / "log")}
    if example.venv is not None:
        environment.pop("PYTHONPATH", None)  # another MuJoCo's, perhaps
    begin = time.monotonic()
    done = subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True, check=False)
    if done.returncode:
        raise RuntimeError(f"examples/{name}.py failed:\n{done.stdout}\n{done.stderr}")
    *printed, answers = done.stdout.splitlines()
    # Notes of packages to their users are no output of an example.
    kept = [line for line in printed if not line.startswith("[robosuite")]
    warned = "ContactWarning" in done.stderr
    return Outcome("\n".join(kept), json.loads(answers), warned, time.monotonic() - begin)


def page_of(name: str) -> Callable[[str], None]:
    """What writes an example's output to its page."""
    return table_on_page(ROOT / "docs" / EXAMPLES[name].page, f"examples/{name}.py")


def put_on_page(name: str, printed: str, folder: Path) -> None:
    """Write what an example printed to its page, and its pictures beside the others."""
    page_of(name)(f"```text\n{printed}\n```")
    PICTURES.mkdir(parents=True, exist_ok=True)
    for picture in folder.glob("*.png"):
        shutil.copy(picture, PICTURES / picture.name)


def main() -> None:
    """The command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("names", nargs="*", metavar="example", help=f"of {', '.join(EXAMPLES)}; all by default")
    names: list[Any] = parser.parse_args().names or list(EXAMPLES)
    for name in names:
        if name not in EXAMPLES:
            parser.error(f"there is no example {name!r}. Available: {', '.join(EXAMPLES)}.")
        page_of(name)  # a page that cannot be written is found before long work
    for name in names:
        with tempfile.TemporaryDirectory() as folder:
            outcome = run(name, Path(folder))
            put_on_page(name, outcome.printed, Path(folder))
        forces = ", ".join(f"{pad} {found['force']:.3g} N" for pad, found in outcome.pads.items())
        print(f"{name}: {outcome.seconds:.1f} s{'; ' + forces if forces else ''}", flush=True)


if __name__ == "__main__":
    main()
