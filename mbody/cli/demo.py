"""`mbody demo`: Norton's four-bar, and the book's answers beside ours."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from mbody.solution.solution import Solution


#: The book's answers: components, then magnitude and direction [deg], of forces on a link [lbf];
#: the driving torque [lbf·in].
PRINTED = {
    "F12": (-117.65, -107.84, 159.60, 222.52),
    "F32": (118.13, 100.34, 154.99, 40.35),
    "F43": (-1.34, 87.43, 87.44, 90.88),
    "F14": (-20.23, 77.71, 80.30, 104.59),
    "T12": (243.23,),
}


def demo(args: Any = None) -> int:
    """Norton's four-bar, and the book's answers beside ours."""
    from mbody.analysis.driven.driven import kinetostatics
    from mbody.gallery import load

    print(*_comparison(kinetostatics(load("norton_fourbar_printed"))), "", sep="\n")
    print("With the exact masses, weight by g = 386 in/s²:\n")
    print(kinetostatics(load("norton_fourbar")))
    print(f"\nSee it move, in a browser:  {_command()} view norton_fourbar --open")
    return 0


def _command() -> str:
    """How this command is called here."""
    import shutil
    import sys
    from pathlib import Path

    if shutil.which("mbody"):
        return "mbody"
    beside = Path(sys.executable).parent / "mbody"
    if not beside.exists():
        return f"{sys.executable} -m mbody"
    here = Path.cwd()
    return str(beside.relative_to(here) if beside.is_relative_to(here) else beside)


def _comparison(run: Solution) -> list[str]:
    """The book's answers, ours with its rounded masses, and the differences."""
    from mbody.sheets.text_table import Column, paragraph, table

    force, torque = (run.mechanism.units.of(kind) for kind in ("force", "torque"))
    rows: list[tuple[str, str, str, str, str, str]] = []
    for name, printed in PRINTED.items():
        ours = _answers(run, name)
        kinds = [("x", force), ("y", force), ("magnitude", force), ("direction", "deg")]
        if len(printed) == 1:
            kinds = [("", torque)]
        for (kind, unit), theirs, mine in zip(kinds, printed, ours, strict=True):
            difference, mark = mine - theirs, ""
            if abs(difference) > 0.005:
                mark = "differs"
                if kind == "direction":
                    mark = f"the book's own x and y give {_direction(*printed[:2]):.3f}"
            rows.append(
                (
                    f"{name} {kind}",
                    f"{theirs:.2f}",
                    f"{mine:.4f}",
                    f"{round(difference, 4) + 0.0:+.4f}",
                    unit,
                    mark,
                )
            )
    heads = ("THE BOOK", "printed", "mbody", "difference", "unit", "")
    columns = [
        Column(head, cells, text=head in ("THE BOOK", "unit", ""))
        for head, cells in zip(heads, zip(*rows, strict=True), strict=True)
    ]
    agree = sum(not row[-1] for row in rows)
    own = sum(row[-1].startswith("the book") for row in rows)
    masses = ", ".join(f"{body.mass:.3f}" for body in run.mechanism.bodies)
    opening = (
        f"The book rounds the masses to {masses} {run.mechanism.units.mass}. With these, its "
        "answers beside ours:"
    )
    ending = (
        f"{agree} of {len(rows)} agree to the last printed digit; {own} printed "
        "directions do not follow from the book's own x and y."
    )
    return [*paragraph(opening), "", *table(columns), "", *paragraph(ending)]


def _answers(run: Solution, name: str) -> list[float]:
    """A torque, or components, magnitude and direction [deg] of a force, by its textbook name."""
    from mbody.sheets.text_table import force_names

    element, on = next(
        (e, on) for e, (known, on) in force_names(run.mechanism).items() if known == name
    )
    if name.startswith("T"):
        return [float(run.effort(element)[0])]
    reaction = run.reaction(element, on)
    x, y = float(reaction.fx[0]), float(reaction.fy[0])
    return [x, y, float(reaction.magnitude[0]), _direction(x, y)]


def _direction(x: float, y: float) -> float:
    return math.degrees(math.atan2(y, x)) % 360.0
