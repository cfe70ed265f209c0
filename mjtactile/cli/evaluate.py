"""The command line: `mjtactile evaluate`."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Any

import typer

from mjtactile.cli.options import AsJson, PageOption, show_table
from mjtactile.experiments.markdown import markdown_table
from mjtactile.fidelity import DEFAULT
from mjtactile.units import MOST_SEED

#: All presses are in memory together, about 20 kB each.
_MOST_PRESSES = 100_000


def evaluate(
    seed: Annotated[int, typer.Option(min=0, max=MOST_SEED, help="Seed of the presses and the noise.")] = 1,
    presses: Annotated[int, typer.Option(min=20, max=_MOST_PRESSES, help="Number of presses in MuJoCo.")] = 2000,
    fidelity: Annotated[
        list[str] | None,
        typer.Option(
            help="Fidelity of the sensor: fast, balanced, precise or accurate. Repeat the option to compare several.  "
            "[default: balanced]"
        ),
    ] = None,
    law: Annotated[
        list[str] | None,
        typer.Option(help="Contact law: uniform, foundation or elastic; may be repeated.  [default: the fidelity's]"),
    ] = None,
    workers: Annotated[int, typer.Option(min=1, help="Processes, one core each.")] = 2,
    weights: Annotated[
        Path | None,
        typer.Option(
            help="Folder of other weights, with subfolders all and top, or one of these.  [default: the package's]"
        ),
    ] = None,
    as_json: AsJson = False,
    page: PageOption = None,
) -> None:
    """Measure the recognisers on new presses: the paper's protocol, and random presses in MuJoCo with noise."""
    from dataclasses import replace

    from mjtactile.fidelity import as_fidelity
    from mjtactile.recognition.evaluation.recognisers import EvaluationSettings, recognisers
    from mjtactile.recognition.evaluation.recognisers import evaluate as measure
    from mjtactile.workers import Workers

    Workers(count=workers)
    sensors = [(name, of) for name in fidelity or [DEFAULT] for of in law or [None]]
    for name, of in sensors:
        known = as_fidelity(name)
        replace(known, law=known.law if of is None else of)
    alone = len(sensors) == 1

    def results() -> Any:
        recognisers(weights)
        found = [
            measure(
                EvaluationSettings(seed=seed, presses=presses, fidelity=name, law=of), workers=workers, folder=weights
            )
            for name, of in sensors
        ]
        return found[0] if alone else found

    part = "evaluate" if alone else "evaluate sensors"
    show_table(results, tables if alone else side_by_side, part, page, as_json=as_json)


def tables(result: dict[str, Any]) -> str:
    """All tables of one sensor's result of `recognisers.evaluate` with their titles, as Markdown."""
    parts = (
        f"Seed {result['seed']}, preset {result['preset']}, law {result['law']}, "
        f"{result['presses']} presses in MuJoCo.\nPad: a {result['pad']}.",
        markdown_table(
            ("figure", "unit", "bound", "all layers", "top layer"),
            [
                (*names, *(text(result[part][layers]) for layers in ("all", "top")))
                for names, part, text in _summary_rows()
            ],
        ),
        "Each contact by itself, MuJoCo, 1 % noise, all layers / the top one:",
        shape_table(result),
        "With what noise the layers differ, MuJoCo, all layers / the top one:",
        noise_table(result),
        "Transducers of 100 kPa full scale with 1 % noise, all forces from 5 gf on, all layers / the top one:",
        transducer_table(result),
        "Contacts that were not taught, MuJoCo, 1 % noise, all layers / the top one. A force is wrong if it is off by "
        "more than 10 %:",
        stranger_table(result),
    )
    return "\n\n".join(parts)


def side_by_side(results: list[dict[str, Any]]) -> str:
    """Table of every quantity with its bound, with a column for each sensor's result of `evaluate`, as Markdown."""
    head = ("figure", "unit", "bound", *(f"{result['preset']}, {result['law']}" for result in results))
    rows = [
        (*names, *(" / ".join(text(result[part][layers]) for layers in ("all", "top")) for result in results))
        for names, part, text in _summary_rows(three="; ")
    ]
    title = (
        f"Pad: a {results[0]['pad']}.\nSeed {results[0]['seed']}, {results[0]['presses']} presses in MuJoCo for each "
        "preset and contact law, all layers / the top one:"
    )
    return f"{title}\n\n{markdown_table(head, rows)}"


def _summary_rows(three: str = " / ") -> list[tuple[tuple[str, str, str], str, Callable[[dict[str, Any]], str]]]:
    """Name, unit and bound of every quantity; the part of a result that contains it; and its value as text."""

    def of_three(figures: dict[str, Any]) -> str:
        return three.join(_number(100 * rate, ".4g") for rate in figures["three_rate"].values())

    return [
        (("direction, protocol, mean", "deg", "<= 0.05"), "protocol", lambda r: _number(r["direction_deg"], ".3f")),
        (("magnitude, protocol, mean", "gf", "<= 0.05"), "protocol", lambda r: _number(r["magnitude_gf"], ".3f")),
        (
            ("seven shapes, protocol", "right", "56 of 56"),
            "protocol",
            lambda r: f"{r['shapes_right']} of {r['shapes_asked']}",
        ),
        (("circle / triangle / square, protocol", "%", "100 / 100 / 100"), "protocol", of_three),
        (("direction, MuJoCo, median", "deg", "<= 0.5"), "mujoco", lambda r: _number(r["direction_median_deg"], ".3f")),
        (
            ("magnitude, MuJoCo, mean", "% of 200 gf", "<= 0.5"),
            "mujoco",
            lambda r: _number(100 * r["magnitude_of_200gf"], ".3f"),
        ),
        (("position, MuJoCo, mean", "mm", "<= 0.1"), "mujoco", lambda r: _number(r["position_mean_mm"], ".3f")),
        (("seven shapes, MuJoCo", "%", ">= 99.6"), "mujoco", lambda r: _number(100 * r["shape_rate"], ".2f")),
        (("circle / triangle / square, MuJoCo", "%", "100 / 100 / 100"), "mujoco", of_three),
    ]


def _number(value: float, form: str) -> str:
    """A number as text; "-" for what could not be measured, such as the rate of a shape of which there is no press."""
    return "-" if math.isnan(value) else format(value, form)


#: Columns of tables with a row for each contact, noise or array: title, and function from a row's figures to text.
_COLUMNS: dict[str, Callable[[dict[str, Any]], str]] = {
    "direction, median deg": lambda r: _number(r["direction_median_deg"], ".3f"),
    "magnitude, gf": lambda r: _number(r["magnitude_mean_gf"], ".2f"),
    "position, mm": lambda r: _number(r["position_mean_mm"], ".3f"),
    "shape right, %": lambda r: _number(100 * r["shape_rate"], ".2f"),
    "unfamiliar, %": lambda r: _number(100 * r["unfamiliar_rate"], ".1f"),
}
_FIRM_COLUMN = {"from 50 gf on, %": lambda r: _number(100 * r["shape_rate_firm"], ".2f")}
_OF_SHAPES = {
    "direction, median deg": lambda r: _number(r["direction_median_deg"], ".2f"),
    "shape right, %": lambda r: _number(100 * r["rate"], ".2f") if "rate" in r else "-",
}
_OF_STRANGERS: dict[str, Callable[[dict[str, Any]], str]] = {
    "unfamiliar, %": lambda r: _number(100 * r["unfamiliar"], ".0f"),
    "force wrong, %": lambda r: _number(100 * r["wrong"], ".0f"),
    "wrong, confidence over 1/2, %": lambda r: _number(100 * r["confident"], ".0f"),
    "wrong and called familiar, %": lambda r: _number(100 * r["missed"], ".0f"),
}


def shape_table(result: dict[str, Any]) -> str:
    """Table of the errors for each shape, for all layers and for the top one, as Markdown."""
    by_layers = {layers: figures["by_shape"] for layers, figures in result["mujoco"].items()}
    return _rows_table(("contact", "presses"), _rows(by_layers, "presses"), _COLUMNS | _OF_SHAPES)


def noise_table(result: dict[str, Any]) -> str:
    """Table of the errors at each level of noise, for all layers and for the top one, as Markdown."""
    rows = [((f"{100 * row['noise']:g} %",), row) for row in result["noise"]]
    return _rows_table(("noise",), rows, _COLUMNS)


def transducer_table(result: dict[str, Any]) -> str:
    """Table of the errors with each kind of transducer array, for all layers and for the top one, as Markdown."""
    rows = [((row["transducer"],), row) for row in result["transducers"]]
    return _rows_table(("transducers",), rows, _COLUMNS | _FIRM_COLUMN)


def stranger_table(result: dict[str, Any]) -> str:
    """Table of what recognisers say of contacts that they were not taught, as Markdown."""
    return _rows_table(("contact", "contacts"), _rows(result["strangers"], "contacts"), _OF_STRANGERS)


#: A row's own cells, and its figures by layers.
_Row = tuple[tuple[str, ...], dict[str, Any]]


def _rows(by_layers: dict[str, dict[str, dict[str, Any]]], count: str) -> list[_Row]:
    """A row for each contact with its number, from figures by layers and contact."""
    return [
        ((contact, str(one[count])), {layers: figures[contact] for layers, figures in by_layers.items()})
        for contact, one in by_layers["all"].items()
    ]


def _rows_table(titles: tuple[str, ...], rows: list[_Row], columns: dict[str, Callable[[dict[str, Any]], str]]) -> str:
    cells = [
        (*own, *(" / ".join(text(figures[layers]) for layers in ("all", "top")) for text in columns.values()))
        for own, figures in rows
    ]
    return markdown_table((*titles, *columns), cells)
