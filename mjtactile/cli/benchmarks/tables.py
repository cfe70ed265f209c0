"""Benchmark results as Markdown tables, and the pages into which they are written."""

from __future__ import annotations

import json
import re
import tomllib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from mjtactile._files import check_writable, read_text, why_unread, write_atomically
from mjtactile.cli.benchmarks.cases import CALCULIX_GROUPS
from mjtactile.cli.benchmarks.front import front
from mjtactile.errors import MjTactileError
from mjtactile.experiments.markdown import markdown_table
from mjtactile.fidelity import PRESETS, by_layer_text
from mjtactile.sim.assets import asset_path


def mesh_table(result: dict[str, Any]) -> str:
    """The result of `mesh.mesh_benchmark` as a Markdown table."""
    titles = ["mesh", "build", "table", "peak memory", "load", "update, new footprint", "update, same footprint"]
    rows = []
    for name, row in result["meshes"].items():
        error = "-" if name == result["reference"] else _median_worst(list(row["errors"].values()))
        sizes = [f"{row['table_bytes'] / 1e6:.0f} MB", f"{row['peak_memory_bytes'] / 1e9:.2f} GB"]
        times = [f"{row[f'{kind}_footprint_s'] * 1e3:.1f} ms" for kind in ("new", "same")]
        rows.append([name, f"{row['build_s']:.1f} s", *sizes, f"{row['load_s'] * 1e3:.0f} ms", *times, error])
    tactile = f"MuJoCo {result['mujoco_version']} `<tactile>`, 676 points"
    times = [f"{result['mujoco_tactile_s'] * 1e3:.3f} ms"] * 2
    rows.append([tactile, *["-"] * 4, *times, "penetration depth, no stress"])
    return markdown_table([*titles, f"error against {result['reference']}: median (worst)"], rows)


def table_on_page(path: Path | None, name: str) -> Callable[[str], None]:
    """A function that writes a table between the markers `<!-- bench NAME -->` and `<!-- end -->` of a Markdown file.

    The file is checked at once, so that a wrong path is reported before long work. It is read again for writing.

    Args:
        path: the Markdown file; None for a function that does nothing.
        name: the table's name in the markers.

    Raises:
        MjTactileError: the file is missing, is not a text file, cannot be written, or lacks the markers. The returned
            function raises the same.
    """
    if path is None:
        return lambda table: None
    _table_in(path, _page(path), name)
    check_writable(path)

    def write(table: str) -> None:
        text = _page(path)
        start, end = _table_in(path, text, name).span(1)
        write_atomically(path, lambda file: file.write(f"{text[:start]}{table}\n{text[end:]}".encode()))

    return write


def _page(path: Path) -> str:
    try:
        return read_text(path)
    except (OSError, ValueError) as error:
        raise MjTactileError(
            f"cannot put a table into {path}: {why_unread(error)}. Name an existing Markdown file."
        ) from error


def _table_in(path: Path, text: str, name: str) -> re.Match[str]:
    """The match of a table with its markers; group 1 is the table."""
    found = re.search(rf"<!-- bench {re.escape(name)} -->\n(.*?)<!-- end -->", text, flags=re.DOTALL)
    if found is None:
        raise MjTactileError(
            f"{path} has no lines '<!-- bench {name} -->' and '<!-- end -->'. Add them; the table is put between them."
        )
    return found


def trade_table(result: dict[str, Any]) -> str:
    """The result of `trade.trade_benchmark` as a Markdown table.

    Presets come first, then the other fidelities on the Pareto front, then direct solutions and MuJoCo's own sensor.
    """
    rows = result["rows"]
    presets = [row for name in PRESETS for row in rows if row["preset"] == name]
    others = [row for row in front(rows) if row["preset"] is None]
    groups = list(CALCULIX_GROUPS.values())
    titles = [
        "preset",
        "mesh",
        "law",
        "cells",
        "points per axis",
        "precision",
        "reduction",
        "table",
        "error against finest: median (worst)",
        *(f"CalculiX {group}: median (worst)" for group in groups),
        "moved: flat face",
        "moved: other body",
        "unchanged",
    ]
    rows = [_trade_cells(row, result) for row in (*presets, *others)]
    solves = [("direct FEM solve of one load", mesh, seconds) for mesh, seconds in result["direct_s"].items()]
    tactile = f"MuJoCo {result['mujoco_version']} `<tactile>`, 676 points"
    for name, mesh, seconds in (*solves, (tactile, "-", result["mujoco_tactile_s"])):
        times = [_milliseconds(seconds)] * 3
        rows.append([name, mesh, *["-"] * (len(titles) - 2 - len(times)), *times])
    return markdown_table(titles, rows)


def stored_runs() -> dict[str, Any]:
    """Arguments of `today_table`: other sensors' rows, and the results that `make tables` stored last."""
    return {
        "others": tomllib.loads(asset_path("benchmarks/today.toml").read_text())["other"],
        "trade": json.loads(asset_path("benchmarks/trade.json").read_text()),
        "plugin": json.loads(asset_path("benchmarks/plugin.json").read_text()),
    }


def today_table(others: list[dict[str, Any]], trade: dict[str, Any], plugin: dict[str, Any]) -> str:
    """The README's table in Markdown: two presets beside the sensors that people use today.

    The arguments are the entries `[[other]]` of benchmarks/today.toml, and results of `bench trade` and `bench plugin`.
    """
    added = {row["name"]: row["added_s"] for row in plugin["rows"]}
    titles = ["", "reports", "below the surface", "error against CalculiX", "box adds to a step", "star adds to a step"]
    rows = []
    for name in ("fast", "balanced"):
        (row,) = (one for one in trade["rows"] if one["preset"] == name)
        times = [
            " / ".join(_microseconds(added[f"{how} {shape}, {name}"]) for how in ("unchanged", "moving"))
            for shape in ("box", "star")
        ]
        error = _median_worst([value for case, value in row["calculix"].items() if case.startswith("B2_")])
        rows.append([f"**mjtactile, {name}**", "von Mises stress", "four depths", error, *times])
    for other in others:
        match other.get("measured"):
            case "direct":
                times = [_milliseconds(trade["direct_s"]["default"])] * 2
            case "tactile":
                times = [_microseconds(added[f"MuJoCo `<tactile>`, {shape}"]) for shape in ("box", "star")]
            case _:
                times = ["-", "-"]
        rows.append([other["name"], other["reports"], other["below"], other["error"], *times])
    return markdown_table(titles, rows)


def _microseconds(seconds: float) -> str:
    return f"{seconds * 1e6:.1f} us"


def rounded(result: Any) -> Any:
    """A result with every float rounded to four digits; repeated timings agree to fewer."""
    if isinstance(result, dict):
        return {name: rounded(value) for name, value in result.items()}
    if isinstance(result, list):
        return [rounded(value) for value in result]
    return float(f"{result:.4g}") if isinstance(result, float) else result


def _trade_cells(row: dict[str, Any], result: dict[str, Any]) -> list[str]:
    errors = list(row["errors"].values())
    grouped = [
        [value for name, value in row["calculix"].items() if name.startswith(f"{group}_")] for group in CALCULIX_GROUPS
    ]
    flat = [row["moved_s"][name] for name in result["flat"]]
    other = [seconds for name, seconds in row["moved_s"].items() if name not in result["flat"]]
    return [
        f"**{row['preset']}**" if row["preset"] else "",
        row["mesh"],
        row["law"],
        str(row["cells"] or "-"),
        ", ".join(map(str, row["points"])),
        ", ".join([by_layer_text(row["precision"]), *_unusual(row)]),
        f"{row['reduction']:g}",
        f"{row['table_bytes'] / 1e6:.0f} MB",
        _median_worst(errors),
        *(_median_worst(values) for values in grouped),
        _milliseconds(float(np.median(flat))),
        _milliseconds(float(np.median(other))),
        _milliseconds(float(np.median(list(row["unchanged_s"].values())))),
    ]


def _unusual(row: dict[str, Any]) -> list[str]:
    """Averaging and loads where they differ from the defaults."""
    unusual = [f"averaging {by_layer_text(row['averaging'])}"] if row["averaging"] != "points" else []
    return unusual + ([f"loads on {row['loads']}"] if row["loads"] != "nodes" else [])


def _median_worst(errors: list[float]) -> str:
    if len(errors) == 1:
        return f"{errors[0]:.2%}"
    return f"{np.median(errors):.2%} ({max(errors):.2%})"


def _milliseconds(seconds: float) -> str:
    return f"{seconds * 1e3:.3g} ms" if seconds < 1.0 else f"{seconds:.1f} s"
