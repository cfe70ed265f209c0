"""What people at the page asked for, until the simulation's thread takes it up."""

from __future__ import annotations

from dataclasses import dataclass, field

from mjtactile._types import Array


@dataclass(eq=False)
class Controls:
    """Wishes; the page writes them, the viewer reads them between two steps.

    Attributes:
        paused: the simulation stands still.
        steps: it goes on by so many steps though.
        recording: frames are kept.
        replaying: what was recorded is shown, and the simulation stands still.
        speed: simulated time over real time, for those who keep pace.
        force_length: of arrows per force [m/N].
        twist_length: of arrows per moment [m/(N m)].
        controls: values that actuators are to have, by actuator, not yet written.
        body: that is dragged, or could be; None for none.
        dragged_to: where the body is dragged [m], world; None when nobody drags.
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
        """Whether the simulation is to stand still."""
        return self.replaying or (self.paused and self.steps == 0)

    def let_go(self) -> None:
        """Drop every pause and pull, as when the last browser has left."""
        self.paused, self.replaying, self.steps, self.dragged_to = False, False, 0, None
