"""Requests of users of the page, for the simulation's thread."""

from __future__ import annotations

from dataclasses import dataclass, field

from mjtactile._types import Array


@dataclass(eq=False)
class Controls:
    """Requests that the page writes and the viewer reads between two steps."""

    paused: bool = False  #: the simulation is paused
    steps: int = 0  #: number of single steps to make while it is paused
    recording: bool = False  #: frames are recorded
    replaying: bool = False  #: the recording is shown, and the simulation is paused
    speed: float = 1.0  #: simulated time over real time [-], for loops that use `Clock`
    force_length: float = 0.01  #: length of arrows per force [m/N]
    torsion_length: float = 5.0  #: length of arrows per moment [m/(N m)]
    #: New values by the actuator's id, not yet written to the simulation.
    controls: dict[int, float] = field(default_factory=dict)
    body: int | None = None  #: id of the body that is selected for dragging; None for none
    dragged_to: Array | None = None  #: target of the dragged body in the world [m]; None while nobody drags

    @property
    def holds(self) -> bool:
        """Whether the simulation is to pause before its next step."""
        return self.replaying or (self.paused and self.steps == 0)

    def let_go(self) -> None:
        """Reset pause, replay and dragging, for example when the last browser has disconnected."""
        self.paused, self.replaying, self.steps, self.dragged_to = False, False, 0, None
