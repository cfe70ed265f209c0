"""Requests of users of the page, for the simulation's thread."""

from __future__ import annotations

from dataclasses import dataclass, field

from mjtactile._types import Array


@dataclass(eq=False)
class Controls:
    """Requests that the page writes and the viewer reads between two steps.

    Attributes:
        paused: the simulation is paused.
        steps: number of single steps to make while it is paused.
        recording: frames are recorded.
        replaying: the recording is shown, and the simulation is paused.
        speed: simulated time over real time [-], for loops that use `Clock`.
        force_length: length of arrows per force [m/N].
        twist_length: length of arrows per moment [m/(N m)].
        controls: new values by the actuator's id, not yet written to the simulation.
        body: id of the body that is selected for dragging; None for none.
        dragged_to: target of the dragged body in the world [m]; None while nobody drags.
    """

    paused: bool = False
    steps: int = 0
    recording: bool = False
    replaying: bool = False
    speed: float = 1.0
    force_length: float = 0.01
    twist_length: float = 5.0
    controls: dict[int, float] = field(default_factory=dict)
    body: int | None = None
    dragged_to: Array | None = None

    @property
    def holds(self) -> bool:
        """Whether the simulation is to pause before its next step."""
        return self.replaying or (self.paused and self.steps == 0)

    def let_go(self) -> None:
        """Reset pause, replay and dragging, for example when the last browser has disconnected."""
        self.paused, self.replaying, self.steps, self.dragged_to = False, False, 0, None
