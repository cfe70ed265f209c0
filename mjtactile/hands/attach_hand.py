"""Attach all pads of a hand in one call."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable

import mujoco

from mjtactile.attach import attach_pad, check_free, check_spec
from mjtactile.errors import SceneError, of_type, shortened
from mjtactile.fidelity import DEFAULT, Fidelity
from mjtactile.hands.catalogue import Hand, HandPad, as_hand
from mjtactile.hands.model_files import check_geom


def attach_hand(
    spec: mujoco.MjSpec,
    name: str | Hand,
    *,
    fidelity: str | Fidelity = DEFAULT,
    prefix: str = "",
    only: Iterable[str] | None = None,
    output: str | None = "von_mises",
    visual: bool = False,
) -> dict[str, mujoco.MjsGeom]:
    """Attach the pads of a hand to a model that contains the hand.

    Args:
        spec: model specification; compile it afterwards.
        name: name of the hand, one of `HANDS`; or a Hand.
        fidelity: fidelity of all pads. Their tables are built at the first use: a hand with many shapes of pads takes
            minutes at "balanced", and a minute or two at "fast".
        prefix: prefix of the names of the hand's bodies in this model, such as "gripper0_right_" in robosuite; names of
            pads get the same prefix.
        only: names of the pads to attach, without prefix; all if None.
        output: outputs of the sensors, see `attach_pad`.
        visual: whether heat maps are drawn on the pads, see `attach_pad`.

    Returns:
        The pads' geoms by the names of their sensors, including the prefix.

    Raises:
        SceneError: there is no such hand or pad, two pads have one name, `prefix` or `only` is no text or names, the
            model lacks a body or a geom that the hand's table needs, it has one of these pads already, the fidelity or
            the output does not exist, or `visual` is no bool. No pad is attached then.
        NativeError: the plugin cannot be registered with this MuJoCo.
    """
    check_spec(spec)
    chosen = as_hand(name)
    of_type(str, "prefix", prefix, SceneError, "such as 'gripper0_right_'; leave it out for none")
    pads = _wanted(chosen, only)
    bodies = {body.name for body in spec.bodies}
    if lacking := sorted({one.body for one in pads if prefix + one.body not in bodies}):
        raise SceneError(
            f"the model has no body '{prefix}{lacking[0]}', which hand '{chosen.name}' has: {chosen.model} "
            f"({chosen.source}). Load that model, or pass prefix=... if its bodies have a prefix here. "
            f"Available: {sorted(body for body in bodies if body)}."
        )
    for expected in chosen.expects:
        if expected.body in {one.body for one in pads}:
            check_geom(spec, chosen, expected, prefix)
    for one in pads:
        check_free(spec, prefix + one.name, one.pad)
    return {
        f"{prefix}{one.name}": attach_pad(
            spec,
            body=prefix + one.body,
            name=prefix + one.name,
            pos=one.pos,
            quat=one.quat,
            pad=one.pad,
            fidelity=fidelity,
            output=output,
            visual=visual,
            contact=chosen.contact,
        )
        for one in pads
    }


def _wanted(chosen: Hand, only: Iterable[str] | None) -> list[HandPad]:
    names = [one.name for one in chosen.pads]
    wanted = names if only is None else _listed(only, names[:1])
    if unknown := sorted(set(wanted) - set(names)):
        raise SceneError(f"hand '{chosen.name}' has no pad '{unknown[0]}'. Available: {', '.join(names)}.")
    pads = [one for one in chosen.pads if one.name in wanted]
    if twice := [one for one, count in Counter(pad.name for pad in pads).items() if count > 1]:
        raise SceneError(f"hand '{chosen.name}' has several pads '{twice[0]}'. Give each a name of its own.")
    return pads


def _listed(only: object, example: list[str]) -> list[str]:
    """The names of an iterable, which may be one that can be read only once."""
    listed = None if isinstance(only, str) or not isinstance(only, Iterable) else list(only)
    if listed is None or not all(isinstance(one, str) for one in listed):
        raise SceneError(f"only = {shortened(only)}; expected names of pads, such as {example}.")
    return listed
