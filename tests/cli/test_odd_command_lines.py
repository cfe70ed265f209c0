"""No command line ends in a traceback, whatever it says: it is refused in one line before work begins, or done."""

from __future__ import annotations

import contextlib
import io
import os
import re
import signal
import stat
import subprocess
import sys
import time
import traceback
import warnings
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from odd_lines import Files, lines, make_files

from mjtactile.cli.main import main

SEED, QUICK, ALL = 13, 60, 300
#: No command line may take longer [s].
PATIENCE = 60
#: What commands do once everything is checked, where it takes long: module and function.
WORK = (
    ("mjtactile.cli.benchmarks.mesh", "mesh_benchmark"),
    ("mjtactile.cli.benchmarks.plugin", "plugin_benchmark"),
    ("mjtactile.cli.benchmarks.trade", "trade_benchmark"),
    ("mjtactile.cli.benchmarks.small_contacts", "small_contacts_benchmark"),
    ("mjtactile.cli.benchmarks.envs", "envs_benchmark"),
    ("mjtactile.cli.benchmarks.extremes", "extremes_benchmark"),
    ("mjtactile.recognition.evaluation.recognisers", "evaluate"),
    ("mjtactile.experiments.grasp.trials", "run_trials"),
    ("mjtactile.experiments.loop.run", "run_loop"),
    ("mjtactile.experiments.study.reproduce", "reproduce"),
)


class WorkBegan(BaseException):
    """Everything was found to be in order."""


class TookTooLong(BaseException):
    """A command that had to be stopped."""


@pytest.fixture(scope="module")
def files(tmp_path_factory) -> Iterator[Files]:
    folder = tmp_path_factory.mktemp("odd")
    made = make_files(folder)
    kinds = {name: stat.S_IFMT(os.lstat(folder / name).st_mode) for name in made.special}
    with contextlib.chdir(folder):
        yield made
    after = {name: stat.S_IFMT(os.lstat(folder / name).st_mode) for name in made.special}
    assert after == kinds, "a device, a pipe or a link was replaced by a file"


@pytest.fixture
def _no_long_work(monkeypatch) -> None:
    def began(*_: object, **__: object) -> None:
        raise WorkBegan

    for module, function in WORK:
        monkeypatch.setattr(f"{module}.{function}", began)


def run(line: list[str], monkeypatch: pytest.MonkeyPatch) -> tuple[int | str, str, str]:
    """Exit code, or what else became of a command, with what it wrote to its two streams."""
    out, err = io.StringIO(), io.StringIO()
    monkeypatch.setattr(sys, "argv", ["mjtactile", *line])
    monkeypatch.setattr(signal, "SIGALRM", signal.SIGALRM)
    before = signal.signal(signal.SIGALRM, _stop)
    signal.alarm(PATIENCE)
    try:
        with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err), warnings.catch_warnings():
            warnings.simplefilter("default")
            main()
        code: int | str = 0
    except SystemExit as ended:
        code = ended.code or 0
    except WorkBegan:
        code = "work began"
    except TookTooLong:
        code = f"more than {PATIENCE} s"
    except Exception:
        code = traceback.format_exc()
    finally:
        signal.alarm(0)
        signal.signal(signal.SIGALRM, before)
    return code, out.getvalue(), err.getvalue()


def _stop(*_: object) -> None:
    raise TookTooLong


def check(line: list[str], code: int | str, out: str, err: str) -> str:
    """What is wrong with how a command line ended; nothing if all is well."""
    said = [one for one in err.splitlines() if not one.startswith("mjtactile: ") or "error: " in one]
    said = [one for one in said if "the figure is drawn without the scene" not in one]
    shown = " ".join(word if len(word) < 60 else word[:60] + "..." for word in line)
    if code == 2:
        if len(said) == 1 and said[0].startswith("mjtactile: error: ") and not out:
            return ""
        return f"{shown!r}: not one line: {out[:200]!r} {err[:600]!r}"
    return "" if code in (0, "work began") else f"{shown!r}: {str(code)[-900:]}"


@pytest.mark.parametrize(
    ("start", "stop"), [(0, QUICK), pytest.param(QUICK, ALL, marks=pytest.mark.slow)], ids=["quick", "all"]
)
@pytest.mark.usefixtures("_no_long_work", "draft")
def test_odd_command_lines_are_refused_in_one_line_or_done(files, start, stop, monkeypatch):
    wrong, refused, slowest = [], 0, (0.0, [""])
    for line in list(lines(files, SEED, ALL))[start:stop]:
        begun = time.perf_counter()
        code, out, err = run(line, monkeypatch)
        slowest = max(slowest, (time.perf_counter() - begun, line))
        refused += code == 2
        wrong += [found for found in (check(line, code, out, err),) if found]
    print(f"{refused} of {stop - start} refused; slowest {slowest[0]:.1f} s: {slowest[1]}")
    assert not wrong, "\n".join(wrong)
    # Most are wrong; a generator of lines that are all well would show nothing.
    assert refused > 0.6 * (stop - start)


@pytest.mark.parametrize(
    ("line", "said"),
    [
        ("press blob", "circle"),
        ("press", "SHAPE|shape"),
        ("press missing.stl", "missing.stl"),
        ("press star --force -5gf", "positive"),
        ("press star --force 5", "100gf"),
        ("press star --force nangf", "force"),
        ("press star --force 900gf", r"at most 2\.5 N \(254\.9 gf\) along each axis"),
        ("press star --scale 1e-3", "--scale is for mesh files; 'star' has a size of its own"),
        ("press sphere --scale 1e-3", "--scale is for mesh files"),
        ("press good.stl --scale 0", "--scale.*0 is not a positive number"),
        ("press good.stl --scale nan", "--scale.*nan is not a finite number"),
        ("press star --shift 1", "1.25,0"),
        ("press star --tilt steep", "--tilt"),
        ("press star --fidelity coarse", "fast, balanced, precise, accurate"),
        ("press star --out /nonexistent/folder/p.npz", "cannot write"),
        ("press star --out p.csv", "ends in .npz"),
        ("press star --tilt 95", "--tilt.*95 degrees do not press; expected more than -90 and less than 90"),
        ("press star --no-such-option", "no-such-option.*See `mjtactile press --help`"),
        ("press star --shift 20,0", r"by \(20, 0\) mm misses the pad, which reaches to \(7.5, 7.5\) mm"),
        ("press star --pad nowhere.toml", "'nowhere.toml'.*: there is no such file. Expected lines such as size ="),
        ("press star --pad pipe", "it is a pipe"),
        ("press star --pad binary.md", "it is not UTF-8 text"),
        ("press missing.stl", "Give the path of one"),
        ("preview nowhere.xml", "cannot open nowhere.xml: there is no such file. Give the path of a model with pads"),
        ("preview folder.npz", "cannot open folder.npz"),
        ("record", "Missing argument.*See `mjtactile record --help`"),
        ("record lift --out made --touch foo", "--touch: 'foo' does not exist. Available: true, recognised"),
        ("record foo --out made", "WHAT: 'foo' cannot be recorded. Available: lift, mjtactile/PressIdentify-v0"),
        ("press star --figure /nonexistent/folder/p.png", "cannot write"),
        ("press star --tilt inf", "--tilt.*inf is not a finite number"),
        ("press star --rotate nan", "--rotate.*nan is not a finite number"),
        ("press star --force 1e-308N", "too small to press"),
        ("press star --force 1e400N", "positive"),
        (f"press {'n' * 300}.stl", "File name too long"),
        (f"press star --out {'n' * 300}.npz", "cannot write.*File name too long"),
        ("press star --figure x.xyz", "ends in .png"),
        ("press star --out folder.npz", "it is a folder"),
        ("press star --out device.npz", "it is a device"),
        ("press star --out pipe", "it is a pipe"),
        ("press star --out to_pipe.npz", "it is a pipe"),
        ("press star --out a.png --figure ./a.png", "--out and --figure are the same file"),
        ("press good.stl --out good.stl", "the mesh and --out are the same file"),
        ("press star --law fast", "contact law 'fast' does not exist"),
        ("press star --tangential coulomb --law uniform", "needs law='elastic'"),
        ("press large.stl", "metres.*--scale 1e-3"),
        ("bench mesh --page nowhere.md", "nowhere.md"),
        ("bench plugin --page plain.md", "has no lines '<!-- bench plugin -->'"),
        ("bench plugin --out pipe", "it is a pipe"),
        ("bench today --page plain.md", "has no lines '<!-- bench today -->'"),
        ("bench trade --figure x.xyz", "ends in .png"),
        ("bench trade --measured odd-3.json", "holds no result"),
        ("bench trade --measured pipe", "it is a pipe"),
        ("bench envs --page binary.md", "cannot put a table"),
        ("envs --page plain.md", "has no lines"),
        ("evaluate --page plain.md", "has no lines '<!-- bench evaluate -->'"),
        ("evaluate --fidelity fast --fidelity best", "'best' does not exist"),
        ("evaluate --law sticky", "'sticky' does not exist"),
        ("evaluate --weights folder.npz", "no recognisers"),
        ("evaluate --presses 99999999999999999999", "Invalid value for .--presses"),
        ("evaluate --workers 1000000", "at most"),
        ("grasp lift --weights folder.npz", "no recognisers"),
        ("grasp lift --out pipe", "it is a pipe"),
        ("grasp lift --noise nan", "Invalid value for .--noise"),
        ("grasp slip --figure x.png", "has no figure"),
        ("grasp sort --trials 99999999999999999999", "Invalid value for .--trials"),
        ("grasp sort --ray --ray-address 127.0.0.1:99999", "no Ray cluster"),
        ("loop --rate 3", "does not divide"),
        ("loop --video loop.mp4", ".gif or .webp"),
        ("loop --fidelity quick", "fast, balanced, precise, accurate"),
        ("loop --figure /nonexistent/loop.png", "cannot write"),
        ("loop --no-record --weights /nonexistent", "nonexistent"),
        ("loop --view", "needs a display"),
        ("loop --layers bottom", "layers = 'bottom'"),
        ("loop --figure a.gif --video a.gif", "--figure and --video are the same file"),
        ("reproduce --json folder.npz", "it is a folder"),
        ("reproduce --quick --json /nonexistent/s.json", "cannot write"),
        ("reproduce --quick --page /nonexistent/study.md", "Name an existing Markdown file"),
        ("reproduce --quick --fidelity quick", "fast, balanced, precise, accurate"),
        ("reproduce --quick --seeds 0", "seeds"),
        ("reproduce --seeds 99999999999999999999", "Invalid value for .--seeds"),
        ("dataset --spec good.toml --presses 99999999999999999999", "Invalid value for .--presses"),
        ("dataset --spec good.toml --presses 999999999", "GB left"),
        ("dataset --spec good.toml --out notes.txt", "is not a folder"),
        ("dataset --spec pipe", "it is a pipe"),
        ("dataset --spec good.toml --flat", "no flat readings.*Leave out --flat"),
        ("record mjtactile/GraspLift-v0 --out made --fps 7", "has no --fps.*Leave out --fps"),
        ("record mjtactile/GraspLift-v0 --out made --touch true", "has no --touch.*Leave out --touch"),
        ("loop --no-record --figure a.png", "Leave out --figure or --no-record"),
        ("loop --no-record --video a.gif", "Leave out --video or --no-record"),
        ("dataset --spec folder.npz", "it is a folder"),
    ],
)
@pytest.mark.usefixtures("_no_long_work")
def test_what_is_wrong_is_said_before_work_begins(files, line, said, monkeypatch):
    if "device" in line and "device.npz" not in files.special:
        pytest.skip("devices cannot be made here")
    for screen in ("DISPLAY", "WAYLAND_DISPLAY"):
        monkeypatch.delenv(screen, raising=False)
    code, out, err = run(line.split(), monkeypatch)
    assert code == 2, code
    assert check(line.split(), code, out, err) == ""
    assert re.search(said, err), err
    assert not {"loop.png", "loop.gif", "loop.mp4"} & {path.name for path in Path().iterdir()}


def test_a_mesh_of_two_million_triangles_is_refused_at_once(files, monkeypatch):
    with Path("big.stl").open("wb") as file:  # zeros, which take no space
        file.seek(80)
        file.write((2_000_000).to_bytes(4, "little"))
        file.truncate(84 + 50 * 2_000_000)
    begun = time.perf_counter()
    code, _, err = run(["press", "big.stl"], monkeypatch)
    assert code == 2
    assert "200,000 triangles" in err
    assert time.perf_counter() - begun < 10.0
    Path("big.stl").unlink()


def test_a_dataset_of_presses_is_not_made_smaller(files, monkeypatch):
    more = ["dataset", "--spec", "good.toml", "--out", "kept", "--workers", "1"]
    assert run([*more, "--presses", "9"], monkeypatch)[0] == 0
    before = {path: path.read_bytes() for path in Path("kept").iterdir()}
    code, _, err = run([*more, "--presses", "4"], monkeypatch)
    assert code == 2
    assert "at least 9" in err
    assert {path: path.read_bytes() for path in Path("kept").iterdir()} == before


def process(*line: str, **options: Any) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-m", "mjtactile", *line],
        stderr=subprocess.PIPE,
        text=True,
        timeout=PATIENCE,
        **options,
    )


@pytest.mark.skipif(not Path("/dev/full").is_char_device(), reason="there is no full disk to write to")
def test_a_full_disk_is_one_line():
    with Path("/dev/full").open("w") as full:
        done = process("info", stdout=full)
    assert done.returncode == 2
    assert done.stderr.strip().splitlines() == ["mjtactile: error: [Errno 28] No space left on device"]


def test_a_reader_that_has_seen_enough_is_no_error():
    reading, writing = os.pipe()
    os.close(reading)
    with os.fdopen(writing, "w") as pipe:
        done = process("info", stdout=pipe)
    assert done.stderr == ""


@pytest.mark.slow
@pytest.mark.usefixtures("draft")
def test_odd_command_lines_as_processes(files):
    """Whether the streams and exit code of a process are those that hundreds of lines have in this one. Without what
    takes long: here nothing keeps it from beginning."""
    short = ("press", "dataset", "envs", "build")
    # Processes are not given what no process can be given.
    odd = [line for line in lines(files, SEED + 1, 200) if line[0] in short and "\0" not in "".join(line)]
    wrong = []
    for line in odd[:6]:
        done = process(*line, stdout=subprocess.PIPE)
        wrong += [found for found in (check(line, done.returncode, done.stdout, done.stderr),) if found]
    assert not wrong, "\n".join(wrong)
