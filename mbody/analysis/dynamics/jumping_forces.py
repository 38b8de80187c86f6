"""Forces that jump at set times, as of inputs and corners of tables: modes are decided anew."""

from __future__ import annotations

from mbody.analysis.dynamics.events import EventIntegration
from mbody.kernels.step_state import MORE, TIME

__all__ = ["AT_ZERO", "JumpIntegration"]

#: A guard is zero where it is less than this part of its size.
AT_ZERO = 1e-9


class JumpIntegration(EventIntegration):
    """Looks at guards where forces have jumped: no sign change is found there."""

    #: The status of a motion that ended where forces jumped.
    ending = ""

    def _broken(self) -> bool:
        """Whether a guard is below zero."""
        raise NotImplementedError

    def _settle_anew(self) -> str:
        """Decide the modes; a status where the motion ends."""
        raise NotImplementedError

    def settle_jump(self) -> str:
        """Decide the modes anew where forces have jumped, as those of inputs do, beyond what the
        present modes allow; a status where the motion ends there.
        """
        if not self._broken():
            return ""
        return self._settle_anew()

    def _interrupt(self, t: float) -> None:
        super()._interrupt(t)
        if self.guards and not self.ending:  # the first modes follow later
            self.ending = self.settle_jump()

    def _step(self) -> tuple[int, str]:
        if self.target <= (t := float(self.state[TIME])) < self.until:
            self._pass_set_time(t)
        return (MORE, self.ending) if self.ending else super()._step()
