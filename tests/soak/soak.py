"""Random scenes by the thousand, each in a process of its own; then hands of other packages (clients.py).

    make soak SCENES=100 STEPS=200 SEED=7 CLIENTS=
    python tests/soak/soak.py --scenes 500 --sanitize
    python tests/soak/soak.py --only 1234        # one scene here, its MJCF beside the report

The report says what was found, with seeds; of every scene that failed the MJCF and what was said are kept in the output
folder. Exit status 1 where anything was found.
"""

from __future__ import annotations

import argparse
import faulthandler
import gc
import json
import os
import re
import signal
import subprocess
import sys
import time
import traceback
from collections import Counter, defaultdict
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE))
os.environ.setdefault("OMP_NUM_THREADS", "1")
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import drive  # noqa: E402
import numpy as np  # noqa: E402
import random_scenes as scenes  # noqa: E402

#: Findings that are counted but do not fail a run that does not hold to limits of time.
OF_TIME = ("slow",)
_POLL = 0.01


@dataclass
class Outcome:
    """What one scene came to."""

    seed: int
    story: str
    kinds: str
    pads: str
    findings: dict[str, tuple[int, str]] = field(default_factory=dict)
    answer: dict[str, Any] = field(default_factory=dict)


def run_scenes(
    seeds: Iterable[int], steps: int, out: Path, *, pads: Iterable[str], limit: float = 60.0, jobs: int = 2
) -> Iterator[Outcome]:
    """Run scenes, each in a process of its own that begins where this one stands; outcomes as they come.

    Args:
        seeds: of the scenes.
        steps: of each.
        out: folder for what each process says; what nobody needs is removed.
        pads: names of the pads to choose from; their tables are built first.
        limit: time for one scene [s]; what takes longer is ended and reported.
        jobs: processes at a time.
    """
    out.mkdir(parents=True, exist_ok=True)
    pads = tuple(pads)
    scenes.prepare(pads, out.parent / "pads")
    gc.freeze()
    waiting = iter(seeds)
    running: dict[int, tuple[int, float]] = {}
    exhausted = False
    while running or not exhausted:
        while len(running) < jobs and not exhausted:
            seed = next(waiting, None)
            if seed is None:
                exhausted = True
                break
            running[_begin(seed, steps, out, pads)] = seed, time.monotonic()
        ended = [(pid, seed, *_ended(pid, begun, limit)) for pid, (seed, begun) in running.items()]
        for pid, seed, state, how in ended:
            if state:
                del running[pid]
                yield _outcome(seed, out, pads, how)
        if not any(state for _, _, state, _ in ended):
            time.sleep(_POLL)


def _begin(seed: int, steps: int, out: Path, pads: tuple[str, ...]) -> int:
    """Number of a process that runs one scene."""
    sys.stdout.flush()
    sys.stderr.flush()
    pid = os.fork()
    if pid:
        return pid
    status = 1
    try:
        folder = out / f"{seed}"
        folder.mkdir(exist_ok=True)
        os.chdir(folder)  # MuJoCo leaves a log where it runs
        said = os.open("said.txt", os.O_WRONLY | os.O_CREAT | os.O_TRUNC, 0o644)
        os.dup2(said, 1)
        os.dup2(said, 2)
        if "LD_PRELOAD" not in os.environ:  # sanitizers have handlers of their own
            faulthandler.enable(said)
        faulthandler.register(signal.SIGUSR1, said)
        scene = scenes.scene(seed, pads)
        Path("scene.xml").write_text(scenes.mjcf(scene))
        answer = drive.drive(scene, steps)
        gc.collect()  # what is destroyed is part of what is tried
        Path("answer.json").write_text(json.dumps(answer))
        status = 0
    except BaseException:
        traceback.print_exc()
    finally:
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(status)


def _ended(pid: int, begun: float, limit: float) -> tuple[bool, str]:
    """Whether a process has ended, and how where that was not as it should; one that takes too long is ended."""
    found, status = os.waitpid(pid, os.WNOHANG)
    if found:
        if os.WIFSIGNALED(status):
            return True, f"the process died of {signal.Signals(os.WTERMSIG(status)).name}"
        return True, "" if os.WEXITSTATUS(status) == 0 else f"the process ended with {os.WEXITSTATUS(status)}"
    if time.monotonic() - begun < limit:
        return False, ""
    os.kill(pid, signal.SIGUSR1)  # faulthandler says where it is
    time.sleep(0.2)
    os.kill(pid, signal.SIGKILL)
    os.waitpid(pid, 0)
    return True, f"no end within {limit:g} s"


def _outcome(seed: int, out: Path, pads: tuple[str, ...], how: str) -> Outcome:
    scene = scenes.scene(seed, pads)
    about = ", ".join(f"{pad.kind} {pad.fidelity}{''.join(f' {v}' for _, v in pad.config)}" for pad in scene.pads)
    outcome = Outcome(seed, scene.story, scene.kinds, about)
    folder = out / f"{seed}"
    said = (folder / "said.txt").read_text(errors="replace") if (folder / "said.txt").is_file() else ""
    if (folder / "answer.json").is_file():
        outcome.answer = json.loads((folder / "answer.json").read_text())
        outcome.findings = {kind: (count, text) for kind, (count, text) in outcome.answer["findings"].items()}
    if how:
        kind = "hangs" if how.startswith("no end") else "crashes"
        outcome.findings[kind] = 1, f"{how}: {_last_frames(said)}"
    elif "Traceback (most recent call last)" in said:
        outcome.findings["traceback"] = said.count("Traceback (most recent call last)"), _last_line(said)
    elif stray := drive.stray(said):
        outcome.findings["stray output"] = len(stray.splitlines()), stray.splitlines()[0]
    if not outcome.findings:
        for file in folder.iterdir():
            file.unlink()
        folder.rmdir()
    return outcome


def _last_line(said: str) -> str:
    """The exception of the first traceback."""
    after = said.split("Traceback (most recent call last)", 1)[1].splitlines()[1:]
    return next((line for line in after if line and not line.startswith(" ")), "?")[:300]


def _last_frames(said: str) -> str:
    """Where a process was: what a sanitizer, or else faulthandler, says first."""
    sanitizer = re.search(r"^.*(ERROR: AddressSanitizer|runtime error).*$", said, re.MULTILINE)
    if sanitizer:
        return sanitizer.group(0).strip()[:300]
    frames = [line.strip() for line in said.splitlines() if line.startswith('  File "')]
    return " < ".join(re.sub(r'File ".*/([^/]+)", line', r"\1", frame) for frame in frames[:4]) or "nothing was said"


@dataclass
class Report:
    """Outcomes counted."""

    outcomes: int = 0
    refused: int = 0
    touched: int = 0
    steps: int = 0
    peak: tuple[float, int] = (0.0, -1)
    python_calls: int = 0
    findings: dict[str, list[tuple[int, int, str]]] = field(default_factory=lambda: defaultdict(list))
    times: dict[str, list[int]] = field(default_factory=lambda: defaultdict(list))
    slowest: dict[str, tuple[int, int]] = field(default_factory=dict)
    stories: Counter[str] = field(default_factory=Counter)

    def add(self, outcome: Outcome) -> None:
        """Count one more."""
        self.outcomes += 1
        self.stories[outcome.story] += 1
        answer = outcome.answer
        self.refused += bool(answer.get("refused"))
        self.touched += answer.get("touched", 0)
        self.python_calls += answer.get("python_calls", 0)
        self.peak = max(self.peak, (answer.get("peak", 0.0), outcome.seed))
        for kind, (count, text) in outcome.findings.items():
            self.findings[kind].append(
                (outcome.seed, count, f"{text}  [{outcome.story}; {outcome.pads}; {outcome.kinds}]")
            )
        for label, times in answer.get("times", {}).items():
            self.steps += len(times)
            self.times[label] += times
            self.slowest[label] = max(self.slowest.get(label, (-1, -1)), (max(times), outcome.seed))

    def failed(self, with_time: bool) -> list[str]:
        """Kinds of findings that fail a run."""
        return [kind for kind in self.findings if with_time or kind not in OF_TIME]

    def text(self, examples: int = 5) -> str:
        """The report for people."""
        lines = [
            f"{self.outcomes} scenes, {self.steps} steps, {self.touched} of them with contact on a pad; "
            f"{self.refused} refused by name; {self.python_calls} calls into Python from within steps; "
            f"highest reading {self.peak[0]:.3g} x its bound (seed {self.peak[1]})",
            "stories: " + ", ".join(f"{count} {story}" for story, count in self.stories.most_common()),
        ]
        for kind, found in sorted(self.findings.items(), key=lambda item: -len(item[1])):
            lines.append(f"{kind}: {len(found)} scenes, {sum(count for _, count, _ in found)} times")
            lines += [f"    seed {seed}: {text}" for seed, _, text in found[:examples]]
            if len(found) > examples:
                lines.append("    further seeds: " + " ".join(str(seed) for seed, _, _ in found[examples:60]))
        lines += ["", *self._table(lambda label: label)]
        for column, name in enumerate(("pad", "fidelity", "what touches")):
            lines += ["", f"by {name}:", *self._table(lambda label, c=column: ([*label.split(" | ")] + [label] * 3)[c])]
        return "\n".join(lines)

    def _table(self, group: Any) -> list[str]:
        grouped: dict[str, list[int]] = defaultdict(list)
        slowest: dict[str, tuple[int, int]] = {}
        for label, times in self.times.items():
            key = group(label)
            grouped[key] += times
            slowest[key] = max(slowest.get(key, (-1, -1)), self.slowest[label])
        rows = [f"{'us added to a step':62s}{'steps':>9s}{'median':>10s}{'99.9 %':>10s}{'slowest':>10s}  seed"]
        for key, times in sorted(grouped.items(), key=lambda item: -slowest[item[0]][0]):
            middle, high = np.percentile(times, (50, 99.9))
            rows.append(f"{key:62s}{len(times):9d}{middle:10.0f}{high:10.0f}{slowest[key][0]:10d}  {slowest[key][1]}")
        return rows


def main() -> int:
    """The command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--scenes", type=int, default=2000)
    parser.add_argument("--steps", type=int, default=500)
    parser.add_argument("--seed", type=int, default=0, help="of the first scene")
    parser.add_argument("--only", type=int, help="seed of one scene, run here without a process of its own")
    parser.add_argument("--jobs", type=int, default=max(1, (os.cpu_count() or 2) // 2))
    parser.add_argument("--limit", type=float, default=60.0, help="seconds for one scene")
    parser.add_argument("--quick-pads", action="store_true", help="only pads whose tables are built within seconds")
    parser.add_argument("--curved-pads", action="store_true", help="only fingertips")
    parser.add_argument("--hold-times", action="store_true", help="contacts slower than the documented limits fail")
    parser.add_argument("--sanitize", action="store_true", help="under AddressSanitizer and UndefinedBehaviorSanitizer")
    parser.add_argument("--out", type=Path, default=scenes.ROOT / "build" / "soak")
    given = parser.parse_args()
    if given.sanitize and "LD_PRELOAD" not in os.environ:
        return _under_sanitizers()
    pads = scenes.QUICK_PADS if given.quick_pads else scenes.CURVED_PADS if given.curved_pads else tuple(scenes.PADS)
    if given.only is not None:
        return _only(given.only, given.steps, pads, given.out)
    report = Report()
    begun = time.monotonic()
    seeds = range(given.seed, given.seed + given.scenes)
    runs = run_scenes(seeds, given.steps, given.out.resolve() / "scenes", pads=pads, limit=given.limit, jobs=given.jobs)
    for outcome in runs:
        report.add(outcome)
        if given.scenes >= 100 and report.outcomes % (given.scenes // 20) == 0:
            failed = ", ".join(f"{kind} {len(found)}" for kind, found in report.findings.items()) or "nothing found"
            print(f"{report.outcomes} scenes, {time.monotonic() - begun:.0f} s: {failed}", flush=True)
    text = report.text()
    (given.out / "report.txt").write_text(text + "\n")
    print(text)
    failed = report.failed(given.hold_times)
    print(f"\n{'FAILED: ' + ', '.join(failed) if failed else 'passed'}; report and failed scenes are in {given.out}")
    return 1 if failed else 0


def _only(seed: int, steps: int, pads: tuple[str, ...], out: Path) -> int:
    scenes.prepare(pads, out.resolve() / "pads")
    scene = scenes.scene(seed, pads)
    (out / f"{seed}.xml").write_text(scenes.mjcf(scene))
    print(
        f"{scene.story}; {scene.kinds}; {[pad.kind for pad in scene.pads]}; MJCF in {out / f'{seed}.xml'}", flush=True
    )
    answer = drive.drive(scene, steps)
    times = answer.pop("times")
    print(json.dumps(answer, indent=2))
    for label, values in times.items():
        print(f"{label}: {len(values)} steps, median {np.median(values):.0f} us, slowest {max(values)} us")
    return 1 if answer["findings"] else 0


def _under_sanitizers() -> int:
    """The same command line, with a core compiled with sanitizers in place of the installed one."""
    runner = HERE.parent / "native_core" / "sanitizers.py"
    command = [sys.executable, str(runner), sys.executable, *sys.argv]
    return subprocess.run(command, check=False).returncode


if __name__ == "__main__":
    sys.exit(main())
