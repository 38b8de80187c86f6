"""Greatest and least values of `solve_for` against brute force: `python -m tests.extrema_scan`.

Random four-bars, slider-cranks and six-bars are searched for a greatest or least value over one
unknown of any kind, under random side conditions. The truth is a scan over the unknown by plain
`kinetostatics`, which follows the branch of the design as it is; and one more plain analysis
at the answer, which must have the value that the answer says and meet the side conditions.
"""

from __future__ import annotations

import argparse
import collections
import contextlib
import functools
import math
import time
import warnings
from dataclasses import dataclass
from typing import Any

import numpy as np

import mbody
from mbody import ModelError, SolveError, Torque, gallery, makers, solve_for
from mbody.analysis.driven.driven import analyse_at
from mbody.errors import ModelWarning
from mbody.inverse.trials import Trials
from mbody.model.simulation import Instants, Question, Unknown
from mbody.solution.histories import link_poses
from mbody.solution.measures import measured

Array = np.ndarray

#: Places of a scan.
PLACES = 1201
#: A scan's value above the answer's by more than this part of the spread of values is a miss: plain
#: analyses agree to 1e-12, and the end of a range is met to 1e-12 of it.
TOLERANCE = 1e-9
#: Rounding of a quantity that is zero, as a part of the size that it may have in the mechanism.
ROUNDING = 1e-11
SIX_BARS = ("watt_sixbar", "stephenson_sixbar")


@dataclass
class Case:
    """One question: of which mechanism, over which unknown and its range, in plain units."""

    seed: int
    machine: mbody.Mechanism
    unknown: str
    low: float
    high: float
    measure: str
    greatest: bool
    sides: tuple[str, ...] = ()
    bounded: bool = True

    @functools.cached_property
    def first(self) -> mbody.Solution:
        """The design as it is."""
        return analyse_at(self.machine, "kinetostatics", Instants())

    @functools.cached_property
    def system(self) -> mbody.System:
        """The system of the design."""
        return mbody.assemble(self.machine)

    @property
    def name(self) -> str:
        """The question, for reports."""
        word = "greatest" if self.greatest else "least"
        return (
            f"{self.seed}: {self.machine.name}, {word} {self.measure} over {self.unknown} in "
            f"[{self.low:g}, {self.high:g}]{'' if self.bounded else ' (open)'}, {self.sides}"
        )


def machine_of(rng: np.random.Generator) -> tuple[mbody.Mechanism, list[str]]:
    """A mechanism that moves, and the lengths that may be unknown."""
    kind = rng.integers(4)
    masses = tuple(rng.uniform(0.2, 3.0, 3))
    speed = float(rng.uniform(-15.0, 15.0))
    start = float(rng.uniform(-math.pi, math.pi))
    if kind <= 1:
        while True:
            a, b, c, d = rng.uniform(0.5, 4.0, 4)
            diagonal = math.hypot(d - a * math.cos(start), a * math.sin(start))
            if abs(b - c) * 1.05 < diagonal < 0.95 * (b + c):
                break
        made = makers.four_bar(
            a, b, c, d, masses=masses, speed=speed, start=start, crossed=bool(kind)
        )
        made.add(Torque("brake", "rocker", value=float(rng.uniform(-20.0, 20.0))))
        return made, ["crank.A.x", "coupler.B.x", "rocker.B.x"]
    if kind == 2:
        a, b = rng.uniform(0.5, 1.5), rng.uniform(1.8, 5.0)
        made = makers.slider_crank(a, b, masses=masses, speed=speed, start=start)
        made.add(Torque("brake", "crank", value=float(rng.uniform(-20.0, 20.0))))
        return made, ["crank.A.x", "rod.B.x"]
    made = gallery.load(str(rng.choice(SIX_BARS)))
    return made, []


def lengths_of(machine: mbody.Mechanism) -> list[str]:
    """Coordinates of points on moving bodies that are not zero."""
    values = mbody.assemble(machine).values
    return [
        f"{body.name}.{key}.{axis}"
        for body in machine.bodies
        for key in body.points
        for axis in "xy"
        if abs(float(values.get(f"{body.name}.{key}.{axis}", 0.0))) > 1e-9
    ]


def measure_of(machine: mbody.Mechanism, rng: np.random.Generator) -> str:
    """A quantity: an effort, a force or its magnitude, an angle, a kink."""
    joint = str(rng.choice([joint.name for joint in machine.joints]))
    body = str(rng.choice([body.name for body in machine.bodies]))
    driver = machine.drivers[0].name
    return str(
        rng.choice(
            [
                f"{driver}.effort",
                f"abs({driver}.effort)",
                f"{joint}.force",
                f"{joint}.fx",
                f"{joint}.fy",
                f"{body}.angle",
                f"{body}.alpha",
                f"max({joint}.fx, {joint}.fy)",
            ]
        )
    )


def case_of(seed: int) -> Case:
    """The question of a seed."""
    rng = np.random.default_rng(seed)
    machine, lengths = machine_of(rng)
    values = mbody.assemble(machine).values
    driver = machine.drivers[0].name
    loads = [n for n in ("brake.value",) if n in values]
    masses = [f"{b.name}.mass" for b in machine.bodies if float(values[f"{b.name}.mass"]) > 0.0]
    kinds = {
        "value": [f"{driver}.value"],
        "length": lengths or lengths_of(machine),
        "mass": masses,
        "load": loads,
        "rate": [f"{driver}.rate"],
    }
    kind = str(rng.choice([key for key, names in kinds.items() if names]))
    unknown = str(rng.choice(kinds[kind]))
    here = _present(machine, unknown)
    if kind == "value":
        low = here - float(rng.uniform(0.3, math.pi))
        high = low + float(rng.uniform(1.0, 2.0 * math.pi))
        low, high = min(low, here), max(high, here)
    else:
        width = abs(here) if here else 1.0
        low, high = (
            here + width * float(part) for part in (rng.uniform(-0.9, 0.0), rng.uniform(0.1, 2.0))
        )
    case = Case(seed, machine, unknown, low, high, measure_of(machine, rng), bool(rng.integers(2)))
    case.bounded = kind != "value" or bool(rng.integers(2))
    if not case.bounded:
        body = machine.drivers[0].bodies[1]
        at = math.degrees(
            float(analyse_at(machine, "kinematics", Instants())[body].angle[0]) - here
        )
        case.sides = (
            f"{body}.angle >= {math.degrees(low) + at!r} deg",
            f"{body}.angle <= {math.degrees(high) + at!r} deg",
        )
    if rng.random() < 0.5:  # a side condition that holds for a part of the range
        other = measure_of(machine, rng)
        _, found = scan(case, [other])
        column = found[np.isfinite(found[:, 0]), 0]
        if len(column):
            limit = float(np.quantile(column, rng.uniform(0.2, 0.8)))
            unit = machine.units.of(measured(case.first, other)[1])
            sign = str(rng.choice(["<=", ">="]))
            case.sides += (f"{other} {sign} {limit!r} {unit}",)
    return case


def _present(machine: mbody.Mechanism, unknown: str) -> float:
    driver, _, key = unknown.partition(".")
    if key in ("value", "rate") and driver == machine.drivers[0].name:
        first = analyse_at(machine, "kinematics", Instants())
        return float(first.driven(driver)[("value", "rate").index(key)][0])
    return float(mbody.assemble(machine).values[unknown])


def plain(case: Case, u: float, guess: Any) -> mbody.Solution:
    """The design with one value, analysed as any other."""
    system, driver = case.system, case.machine.drivers[0].name
    state = [float(part[0]) for part in case.first.driven(driver)]
    owner, _, key = case.unknown.partition(".")
    if owner == driver and key in ("value", "rate"):
        state[("value", "rate").index(key)] = u
    else:
        system = system.with_values({case.unknown: u})
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ModelWarning)
        return mbody.kinetostatics(system, drive={driver: tuple(state)}, guess=guess)


def scan(case: Case, measures: list[str]) -> tuple[Array, Array]:
    """Values over the range, NaN from where the mechanism cannot be analysed any more: places
    (places,) and (places, measures).
    """
    driver, owner = case.machine.drivers[0].name, case.unknown.partition(".")
    first = case.first
    here, poses = _present(case.machine, case.unknown), link_poses(first)
    u = np.linspace(case.low, case.high, PLACES)
    found = np.full((PLACES, len(measures)), np.nan)
    state = [float(part[0]) for part in first.driven(driver)]
    sides = (np.flatnonzero(u >= here), np.flatnonzero(u < here)[::-1])
    for index in sides:
        if not len(index):
            continue
        if owner[0] == driver and owner[2] == "value":
            values = np.append(here, u[index])
            drive = {
                driver: (values, np.full(len(values), state[1]), np.full(len(values), state[2]))
            }
            try:
                run: Any = mbody.kinetostatics(case.machine, drive=drive, guess=poses)
            except SolveError as error:
                run = error.solution
            if run is not None:
                for n, measure in enumerate(measures):
                    history = run.measure(measure)[1:]
                    found[index[: len(history)], n] = history
            continue
        guess = poses
        for k in index:
            try:
                run = plain(case, float(u[k]), guess)
            except (ModelError, SolveError):
                break
            now = link_poses(run)
            if max(abs(now[b][2] - guess[b][2]) for b in now) > 0.4:
                break
            guess = now
            found[k] = [float(run.measure(measure)[0]) for measure in measures]
    return u, found


def holds(run: mbody.Solution, text: str, floor: float) -> float:
    """By how much a side condition holds, as a part of its limit's size, at least the floor."""
    left, sign, right = _split(text)
    a, b = float(run.measure(left)[0]), float(run.measure(right)[0])
    return (b - a if sign == "<=" else a - b) / max(abs(a), abs(b), floor)


def _split(text: str) -> tuple[str, str, str]:
    sign = "<=" if "<=" in text else ">="
    left, right = text.split(f" {sign} ")
    return left, sign, right


def verdict(case: Case) -> tuple[str, str, float]:
    """What became of a case, what is to be said of it, and the seconds that the answer took."""
    u, found = scan(case, [case.measure])
    sign = 1.0 if case.greatest else -1.0
    value = sign * found[:, 0]
    good = np.isfinite(value)
    if case.sides[-1:] and not (len(case.sides) == 2 and not case.bounded):
        good &= _allowed(case, u)
    unknown = Unknown(
        case.unknown, **({"low": case.low, "high": case.high} if case.bounded else {})
    )
    word = "greatest" if case.greatest else "least"
    begin = time.process_time()
    try:
        answer = solve_for(
            case.machine, unknown, side_conditions=case.sides, **{word: case.measure}
        )
    except SolveError as error:
        spent = time.process_time() - begin
        if not good.any() or ("without bound" in str(error) and endless(case, u, value, good)):
            return "none, rightly", str(error), spent
        return "refused", str(error), spent
    spent = time.process_time() - begin
    best = answer[0]
    where = _plain_value(case, best)
    if not good.any():
        top = -math.inf
    else:
        top = float(value[good].max())
    spread = float(np.ptp(value[np.isfinite(value)])) if np.isfinite(value).any() else 0.0
    trials = Trials(case.machine, Question(case.unknown, "t = 0"))
    floors = {side: 1e-3 * trials.size_of(_split(side)[0]) for side in case.sides}
    size = trials.size_of(case.measure)
    rounding = ROUNDING * size
    floor = TOLERANCE * (spread + abs(top) if good.any() else 1.0) + rounding
    again = plain(case, where, link_poses(best.run))
    told = float(again.measure(case.measure)[0])
    off = abs(told - best.objective)
    text = f"{best.objective:.9g} at {where:.9g}, the scan {sign * top:.9g}"
    if good.any():
        text += f" at {u[good][value[good].argmax()]:.9g}"
    wrong = sign * best.objective < top - floor or off > TOLERANCE * (abs(told) + spread) + rounding
    wrong |= any(holds(again, side, floors[side]) < -1e-8 for side in case.sides)
    wrong |= not case.low - 1e-9 <= where <= case.high + 1e-9 and case.bounded
    if answer.doubts:
        return ("doubted, and wrong" if wrong else "doubted"), f"{text}; {answer.status}", spent
    return ("WRONG" if wrong else "agrees"), text, spent


def endless(case: Case, u: Array, value: Array, good: Array) -> bool:
    """Whether plain analyses grow without bound towards an edge of the range that can be scanned:
    by a factor each time that they are a hundred times as near to it.
    """
    sign = 1.0 if case.greatest else -1.0
    whole = np.isfinite(value)
    for k in np.flatnonzero(whole[1:] != whole[:-1]):
        inside, outside = (k, k + 1) if whole[k] else (k + 1, k)
        if not good[inside]:
            continue
        begin, far, near = float(u[inside]), float(u[inside]), float(u[outside])
        guess = link_poses(_followed(case, begin))
        found = {begin: sign * float(value[inside])}
        for _ in range(60):
            middle = 0.5 * (far + near)
            run = _near(case, middle, guess)
            if run is None:
                near = middle
            else:
                far, guess, found[middle] = (
                    middle,
                    link_poses(run),
                    float(run.measure(case.measure)[0]),
                )
        parts = [(abs(place - far), sign * one) for place, one in found.items() if place != far]
        width = abs(far - begin)
        tops = [
            max((one for apart, one in parts if apart >= part * width), default=-math.inf)
            for part in (1e-2, 1e-4, 1e-6)
        ]
        if math.isfinite(tops[0]) and tops[2] > 3.0 * abs(tops[1]) > 9.0 * tops[0]:
            return True
    return False


def _near(case: Case, u: float, guess: Any) -> mbody.Solution | None:
    """The plain analysis there on the branch of a place nearby; None where there is none."""
    try:
        run = plain(case, u, guess)
    except (ModelError, SolveError):
        return None
    now = link_poses(run)
    return None if max(abs(now[b][2] - guess[b][2]) for b in now) > 0.4 else run


def _followed(case: Case, end: float) -> mbody.Solution:
    """The plain analysis at a place that the scan came to, reached from the design as it is."""
    run = case.first
    for u in np.linspace(_present(case.machine, case.unknown), end, PLACES):
        run = plain(case, float(u), link_poses(run))
    return run


def _allowed(case: Case, u: Array) -> Array:
    """Where the last side condition holds along the range."""
    left, sign, right = _split(case.sides[-1])
    _, found = scan(case, [left, right])
    return found[:, 0] <= found[:, 1] if sign == "<=" else found[:, 0] >= found[:, 1]


def _plain_value(case: Case, best: Any) -> float:
    """The unknown as a plain number of the mechanism's units, angles in rad."""
    value, unit = best.unknowns[case.unknown], best.units[case.unknown]
    return math.radians(value) if unit == "deg" else float(value)


def main() -> int:
    """Run so many cases and count; 1 where an answer is wrong without a doubt."""
    asks = argparse.ArgumentParser(description=__doc__)
    asks.add_argument("--count", type=int, default=100)
    asks.add_argument("--seed", type=int, default=0)
    asks.add_argument("--verbose", action="store_true")
    given = asks.parse_args()
    counts: collections.Counter[str] = collections.Counter()
    times = []
    for seed in range(given.seed, given.seed + given.count):
        case = None
        with contextlib.suppress(KeyboardInterrupt):
            case = case_of(seed)
        if case is None:
            break
        kind, text, spent = verdict(case)
        counts[kind] += 1
        times.append(spent)
        if given.verbose or kind not in ("agrees", "none, rightly"):
            print(f"{kind}: {case.name}: {text} ({spent:.2f} s)", flush=True)
    for kind, count in sorted(counts.items()):
        print(f"{count:6d}  {kind}")
    print(f"seconds of processor time: median {np.median(times):.2f}, greatest {max(times):.2f}")
    return int(counts["WRONG"] > 0)


if __name__ == "__main__":
    raise SystemExit(main())
