"""What reads drivers that are to be released: refused before the motion begins."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence

from mbody.analysis.initial.initial_state import event_measure
from mbody.errors import ModelError
from mbody.model.event import Event
from mbody.model.mechanism import Mechanism
from mbody.model.study import Measure, measure_named

__all__ = ["refuse_readings_of_released"]


def refuse_readings_of_released(
    mechanism: Mechanism, gone: Collection[str], events: Sequence[Event] = ()
) -> None:
    """Refuse formulas, controllers and events that read drivers which are released.

    Raises
    ------
    ModelError
    """
    mechanism.without(*gone)  # which refuses those that formulas read
    for name, what, measure in _readings(mechanism, events):
        for quantity in sorted(measure.names):
            driver = quantity.partition(".")[0]
            if driver in gone:
                raise ModelError(
                    f"driver '{driver}' cannot be released, {what} '{name}' reads '{quantity}': "
                    "read the body that it drives, or a joint",
                    name,
                )


def _readings(mechanism: Mechanism, events: Sequence[Event]) -> Iterator[tuple[str, str, Measure]]:
    """Names of controllers and events, what they are, and what they read."""
    for one in mechanism.controllers:
        for text in one.reads:
            yield one.name, "controller", measure_named(mechanism.measures, text)
    for event in events:
        yield event.name, "event", event_measure(mechanism, event)
