"""The table [report] of a model file: what its report contains.

It is no part of the description, which is the same with another report: it is kept beside it.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

from pydantic import Field

from mbody.files.model.fields import Strict
from mbody.model.mechanism import Mechanism

__all__ = ["ReportIn", "ReportSettings", "keep_settings", "report_settings", "settings_table"]


class ReportIn(Strict):
    """What `mbody report` writes."""

    title: str = Field("", description="Title of the document; by default that of the model.")
    author: str = Field("", description="Who made it, below the title.")
    sections: list[str] = Field(default_factory=list, description="The sections in order.")
    without: list[str] = Field(default_factory=list, description="Sections that are left out.")
    plots: list[str] = Field(default_factory=list, description="Quantities that are plotted.")
    polar: list[str] = Field(default_factory=list, description="Joints, their forces as vectors.")


@dataclass(frozen=True)
class ReportSettings:
    """What a report contains, where nobody says otherwise.

    Attributes
    ----------
    title, author : str
    sections, without : tuple of str
        Names of sections, in order, and of those that are left out.
    plots, polar : tuple of str
        Quantities that are plotted; joints whose forces are drawn as vectors.
    """

    title: str = ""
    author: str = ""
    sections: tuple[str, ...] = ()
    without: tuple[str, ...] = ()
    plots: tuple[str, ...] = ()
    polar: tuple[str, ...] = ()


#: Under which it is kept with the mechanism, so that copies of that have it too.
KEPT = "report_settings"


def keep_settings(mechanism: Mechanism, given: ReportIn | None) -> None:
    """Keep what a file says of the report of a mechanism."""
    if given is not None:
        lists = {
            key: tuple(getattr(given, key)) for key in ("sections", "without", "plots", "polar")
        }
        vars(mechanism)[KEPT] = ReportSettings(given.title, given.author, **lists)


def report_settings(mechanism: Mechanism) -> ReportSettings | None:
    """What a file said of the report of a mechanism; None where it said nothing."""
    return vars(mechanism).get(KEPT)


def settings_table(mechanism: Mechanism) -> dict[str, Any]:
    """The table as a file has it; empty where there is none."""
    kept = report_settings(mechanism)
    pairs = asdict(kept).items() if kept is not None else ()
    return {
        key: list(value) if isinstance(value, tuple) else value for key, value in pairs if value
    }
