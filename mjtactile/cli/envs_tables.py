"""Actions and observations of each environment as Markdown tables, which docs/environments.md contains."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

from mjtactile.envs.options import OBSERVATIONS
from mjtactile.envs.registration import ENTRY_POINTS, task_of
from mjtactile.envs.task import Task
from mjtactile.envs.touch import READING_SCALE
from mjtactile.experiments.markdown import markdown_table

#: Shape, unit and meaning in the rows of `tactile`, by observation.
_TACTILE = {
    "readings": (
        "(pads, layers, rows, columns)",
        f"{READING_SCALE / 1e3:g} kPa",
        "von Mises stress at every taxel, pad frame, top layer first",
    ),
    "pascals": ("(pads, layers, rows, columns)", "Pa", "the same, not scaled"),
    "wrench": ("(pads, 6)", "N, N m", "contact force (3) and moment (3) on each pad, pad frame"),
    "recognised": ("(pads, 6)", "N, m, -", "force (3) and position (2) as recognised, confidence; 0 without contact"),
}


def environment_tables() -> str:
    """Summary, actions, observations and episodes of every environment."""
    return "\n\n".join(_environment(name, task_of(name)) for name in ENTRY_POINTS)


def _environment(name: str, kind: type[Task]) -> str:
    period = kind.TIMESTEP * kind.SUBSTEPS
    return "\n".join(
        [
            f"### {name}",
            "",
            kind.SUMMARY,
            "",
            f"Pads: {', '.join(kind.PADS)}. A step is {period * 1e3:g} ms ({kind.SUBSTEPS} of MuJoCo's), an episode at "
            f"most {kind.EPISODE_STEPS} steps. Default noise: {kind.NOISE:.0%}.",
            "",
            markdown_table(
                ["action", "from", "to", "meaning"],
                ([one.name, f"{one.low:g}", f"{one.high:g}", one.meaning] for one in kind.ACTIONS),
            ),
            "",
            markdown_table(
                ["`proprioception`", "unit", "from", "to", "meaning"],
                ([one.name, one.unit, f"{one.low:g}", f"{one.high:g}", one.meaning] for one in kind.PROPRIOCEPTION),
            ),
            "",
            markdown_table(["`tactile`", "shape", "unit", "from", "to", "meaning"], _tactile_rows(kind)),
        ]
    )


def _tactile_rows(kind: type[Task]) -> Iterator[list[str]]:
    for observation in OBSERVATIONS:
        space = kind(observation=observation).touch.space
        if space is None:
            continue
        shape, unit, meaning = _TACTILE[observation]
        sizes = ", ".join(map(str, space.shape))
        yield [observation, f"{shape} = ({sizes})", unit, _ends(space.low), _ends(space.high), meaning]


def _ends(limits: Any) -> str:
    """The limits of a space's components as text; neighbouring equal limits are given once."""
    row: Sequence[float] = limits.reshape(limits.shape[0], -1)[0].tolist()
    runs = [value for k, value in enumerate(row) if k == 0 or value != row[k - 1]]
    return ", ".join(f"{value:g}" for value in runs)
