"""Doubts: what the evidence of a result does not support, and the status that follows from it."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Self, TypeVar

from mbody._version import __version__
from mbody.system.system import lock

#: What a doubt may be about.
KINDS = (
    "residual", "energy", "branch", "singular", "inertia", "extrapolation", "incomplete",
    "contact", "inadmissible", "validity", "derivative", "solver",
)  # fmt: skip

Result = TypeVar("Result")
T = TypeVar("T")


@dataclass(frozen=True)
class Doubt:
    """One reason why a result may be wrong, or may not be all there is.

    Attributes
    ----------
    kind : str
        One of `KINDS`.
    message : str
        A sentence: what is in doubt, by how much, from which instant on, and what to try.
    t : float or None
        The instant from which on the result is in doubt; None where it is no matter of time.
    elements : tuple of str
        Names of the elements that it is about.

    Examples
    --------
    >>> import mbody
    >>> machine = mbody.makers.slider_crank(1, 3, speed=10.0)
    >>> push = mbody.laws.Table([0.0, 0.1], [0.0, 50.0], outside="hold")
    >>> machine.add(mbody.Force("push", "slider.B", push))
    >>> (doubt,) = mbody.kinetostatics(machine, t=[0.0, 0.2]).doubts
    >>> doubt.elements, doubt.t
    (('push',), 0.2)
    """

    kind: str
    message: str
    t: float | None = None
    elements: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        if self.kind not in KINDS:
            raise ValueError(f"a doubt is about one of {', '.join(KINDS)}, not {self.kind!r}")

    def data(self) -> dict[str, Any]:
        """Plain values of the doubt, ready for JSON."""
        keys = ("kind", "t", "elements", "message")
        return {key: list(self.elements) if key == "elements" else vars(self)[key] for key in keys}


def as_doubt(data: Mapping[str, Any]) -> Doubt:
    """The doubt of which these are the `data`.

    >>> as_doubt(Doubt("energy", "the energy grows", 1.0).data()).message
    'the energy grows'
    """
    return Doubt(data["kind"], data["message"], data["t"], tuple(data["elements"]))


def status_of(status: str, doubts: Sequence[Doubt]) -> str:
    """The status of a result: as it ended, or the first doubt.

    >>> status_of("completed", [])
    'completed'
    >>> status_of("completed", [Doubt("energy", "the energy grows", 1.0)])
    'doubtful: the energy grows'
    """
    failed = status.startswith("failed:")
    return f"doubtful: {doubts[0].message}" if doubts and not failed else status


def doubted(result: Result, doubts: Iterable[Doubt]) -> Result:
    """A copy of the result with further doubts: they are in `doubts` and in `notes`, and they
    decide the `status`. A doubt that the result has already is not repeated.
    """
    doubts = list(doubts)
    if not doubts:
        return result
    found: Any = result
    known = {(one.kind, one.message) for one in found.doubts}
    new = [one for one in doubts if (one.kind, one.message) not in known]
    if not new:
        return result
    every = (*found.doubts, *new)
    notes = (*found.notes, *(one.message for one in new if one.message not in found.notes))
    # a result that finds its status by its doubts keeps how it ended
    ending = getattr(found, "ending", None)
    status = status_of(found.status, every) if ending is None else ending
    doubtful: Result = replace(found, doubts=every, notes=notes, status=status)
    return doubtful


#: Designs of a batch that a sentence names.
NAMED = 8


def joined_notes(each: Sequence[Iterable[str] | Exception]) -> list[str]:
    """The sentences of all designs of a batch, each once, with the designs that it is of; what all
    say is said as of one. Of those that failed, of which errors are given, that of the first.

    >>> joined_notes([["it rests"], ["it rests", "it jams"]])
    ['it rests', 'design 1: it jams']
    """
    found: dict[str, list[int]] = {}
    failed = [n for n, notes in enumerate(each) if isinstance(notes, Exception)]
    why = f"failed, as design {failed[0]}: " if failed[1:] else ""
    why += str(each[failed[0]]) if failed else ""
    for n, notes in enumerate(each):
        for note in dict.fromkeys([why] if isinstance(notes, Exception) else notes):
            found.setdefault(note, []).append(n)
    return [f"{_which(designs, len(each))}{note}" for note, designs in found.items()]


def joined_doubts(each: Sequence[Iterable[Doubt]]) -> tuple[Doubt, ...]:
    """The doubts of all designs of a batch, as of `joined_notes`."""
    found: dict[tuple[str, str], list[tuple[int, Doubt]]] = {}
    for n, doubts in enumerate(each):
        for one in doubts:
            found.setdefault((one.kind, one.message), []).append((n, one))
    joined = []
    for (_, message), own in found.items():
        times = [one.t for _, one in own if one.t is not None]
        which = _which([n for n, _ in own], len(each))
        joined.append(replace(own[0][1], message=which + message, t=min(times, default=None)))
    return tuple(joined)


def _which(designs: Sequence[int], count: int) -> str:
    """Designs at the beginning of a sentence; nothing of all."""
    if len(designs) == count:
        return ""
    more = f", … ({len(designs)} of {count})" if designs[NAMED:] else ""
    return f"design{'s'[: len(designs) - 1]} {', '.join(map(str, designs[:NAMED]))}{more}: "


def succeeded(status: str) -> bool:
    """Whether a result of this status is complete and certain: completed, or ended by a requested
    event; neither stopped by the user nor in doubt.

    >>> [succeeded(s) for s in ("completed", "ended: 'x' is zero", "doubtful: …", "stopped: …")]
    [True, True, False, False]
    """
    return status == "completed" or status.startswith("ended:")


@dataclass(frozen=True, kw_only=True, eq=False)
class Inherited:
    """Base of what is made of results: their doubts are its own.

    `status`: "completed", or "doubtful: …" with the first doubt.
    `notes`: Sentences, those of the doubts among them.
    """

    status: str = field(default="completed", repr=False)
    doubts: tuple[Doubt, ...] = field(default=(), repr=False)
    notes: tuple[str, ...] = field(default=(), repr=False)

    def __post_init__(self) -> None:
        lock(self)


class Several(tuple[T, ...]):
    """A tuple of what is made of a result, with the doubts of that result.

    `status`, `doubts`, `notes`: As of `Inherited`.
    """

    status: str
    doubts: tuple[Doubt, ...]
    notes: tuple[str, ...]

    @classmethod
    def of(cls, result: Any, items: Iterable[T]) -> Self:
        """The items, made of a result."""
        made = cls(items)
        for name, value in inherited(result).items():
            setattr(made, name, value)
        return made


def certificate(result: Any) -> dict[str, Any]:
    """Status, doubts and notes of a result as plain values, ready for JSON."""
    return {
        "status": result.status,
        "doubts": [one.data() for one in result.doubts],
        "notes": list(result.notes),
    }


def inherited(*results: Any, of: Iterable[Any] = (), notes: Iterable[str] = ()) -> dict[str, Any]:
    """Arguments `status`, `doubts` and `notes` of what is made of `results`: the doubts of all of
    them, the notes on their descriptions, what is known of the quantities `of` them
    (`Solution.known_of`), and further notes.
    """
    every = [one for result in results for one in getattr(result, "doubts", ())]
    doubts = tuple(dict.fromkeys(every))
    said = [getattr(getattr(result, "system", None), "notes", ()) for result in results]
    described, quantities = [note for notes in said for note in notes], list(of)
    known = [one for result in results for part in quantities for one in result.known_of(part)]
    sentences = dict.fromkeys((*described, *notes, *known, *(one.message for one in doubts)))
    return {"status": status_of("completed", doubts), "doubts": doubts, "notes": tuple(sentences)}


# -- Head of every result as data --------------------------------------------------------------


def heading(
    model: str | None, analysis: str, units: Mapping[str, str], result: Any = None
) -> dict[str, Any]:
    """The first keys of a result as data: ``{"mbody", "model", "analysis", "units", "status",
    "doubts", "notes"}``.

    >>> from mbody.solution.doubts import Inherited
    >>> list(heading("a crank", "statics", {"length": "m"}, Inherited()))
    ['mbody', 'model', 'analysis', 'units', 'status', 'doubts', 'notes']
    """
    head = {"mbody": __version__, "model": model, "analysis": analysis, "units": dict(units)}
    if hasattr(result, "doubts"):
        return head | certificate(result)
    notes = list(getattr(result, "notes", ()))
    return head | {"status": "completed", "doubts": [], "notes": notes}
