"""What is counted: motions over time, motions that are driven, and what symbolic phases plan."""

import contextlib
import functools
import importlib
import pkgutil
import sys
from dataclasses import dataclass
from pathlib import Path
from types import SimpleNamespace

import numpy as np

import mbody
from benchmarks import models
from mbody import gallery
from mbody.analysis.driven.batch import batch_setup, closed_poses, on_lanes
from mbody.analysis.driven.path_following import Runner
from mbody.analysis.driven.time_grid import time_grid
from mbody.analysis.position.assembly_analysis import closed
from mbody.core.selection import COMPILED, PACKAGE
from mbody.quantities import deg

machine = functools.cache(gallery.load)


@dataclass(frozen=True)
class Motion:
    """One call of `simulate` by one method."""

    model: str
    until: float
    method: str
    rtol: float | None = None
    step: float | None = None

    @property
    def name(self):
        how = f"rtol {self.rtol:g}" if self.step is None else f"steps of {self.step:g} s"
        return f"{self.model} to {self.until:g} s by {self.method}, {how}"

    def run(self):
        return mbody.simulate(
            made(self.model),
            self.until,
            rates={"c0": -1.0} if self.model.startswith("windows") else None,
            method=self.method,
            rtol=self.rtol,
            step=self.step,
            instants=2,
        )


@functools.cache
def made(model):
    """A mechanism by name: "chain 10", "windows 10", or of the gallery."""
    kind, _, count = model.partition(" ")
    if kind == "windows":
        return windows(int(count))
    return models.SHAPES[kind](int(count)) if count else machine(model)


def windows(count):
    """Four-bars of equal rods in a row, upright (IFToMM A02, any number of them)."""
    upright = deg(90)

    def rod(name, angle):
        return mbody.makers.bar(name, 1.0, mass=1.0, guess=angle)

    found = mbody.Mechanism(f"{count} windows")
    found.add(*(rod(f"c{n}", upright) for n in range(count + 1)))
    found.add(*(rod(f"b{n}", 0.0) for n in range(count)))
    for n in range(count + 1):
        found.add(mbody.Revolute(f"g{n}", mbody.Marker("ground", (float(n), 0.0)), f"c{n}.A"))
    for n in range(count):
        found.add(mbody.Revolute(f"l{n}", f"c{n}.B", f"b{n}.A"))
        found.add(mbody.Revolute(f"r{n}", f"c{n + 1}.B", f"b{n}.B"))
    found.add(mbody.Gravity("gravity", y=-9.81))
    return found


FOURBAR, ANDREWS, CHAIN = "free_fourbar", "andrews_squeezer", "chain 10"

#: `steps`, `rejected`, `careful`, `evaluations` and `tangents` of compiled motions.
MOTIONS = (
    *(Motion(FOURBAR, 2.0, name, 1e-8) for name in ("dop853", "dopri5", "radau5")),
    *(Motion(ANDREWS, 0.03, name, 1e-8) for name in ("dop853", "dopri5", "radau5")),
    *(Motion(CHAIN, 0.5, name, 1e-8) for name in ("dop853", "dopri5")),
    Motion(CHAIN, 0.1, "radau5", 1e-6),
    *(Motion("windows 2", 10.0, name, 1e-8) for name in ("dop853", "dopri5")),
    # at a singular position after 3 s rounding decides whether steps are rejected
    *(Motion("windows 10", 3.0, name, 1e-8) for name in ("dop853", "dopri5")),
    # through one singular position: after more of them wrong turns of Newton's method add up
    *(Motion(f"windows {n}", 1.0, "radau5", 1e-6) for n in (2, 10)),
    Motion(FOURBAR, 2.0, "rattle4", step=2e-3),
    Motion(ANDREWS, 0.03, "rattle4", step=5e-5),
    Motion(CHAIN, 0.5, "rattle4", step=2e-3),
    Motion("windows 2", 10.0, "rattle4", step=5e-3),
)


@dataclass(frozen=True)
class Driven:
    """Kinetostatics over a whole turn, on the scalar path or on lanes."""

    model: str
    instants: int

    @property
    def name(self):
        path = "on lanes" if self.instants > 100 else "one by one"
        return f"{self.model}, {self.instants} positions of a turn {path}"

    def run(self):
        # the system is new: pivots are planned anew, and their positions count too
        return mbody.kinetostatics(made(self.model), turn=True, instants=self.instants)


@dataclass(frozen=True)
class Beside:
    """Fifteen four-bars on lanes beside one that is lost: they must not wait for it."""

    instants: int

    @property
    def name(self):
        return f"15 of norton_fourbar beside one that is lost, {self.instants} positions on lanes"

    def run(self):
        system = mbody.assemble(made("norton_fourbar"))
        asked = time_grid(system, None, None, "motor", self.instants)
        start = closed(system, 0.0, asked.first(system))
        course = batch_setup(Runner(system, "kinetostatics"), start, asked)
        lengths = system.values["coupler.B.x"] + 0.01 * np.arange(16)
        fifteen = system.with_values({"coupler.B.x": lengths[:15]})
        poses = closed_poses(fifteen, asked, course.pose, course.origin, course.small).poses
        poses = np.vstack([poses, np.full_like(poses[0], np.nan)])
        designs = system.with_values({"coupler.B.x": lengths})
        sound = on_lanes(designs, course, poses, np.array([0]))[1]
        assert sound.tolist() == 15 * [True] + [False]
        return SimpleNamespace(stats=None)


#: Calls of functions within kernels, counted in plain Python: shorter motions, whose steps and
#: evaluations are compared with those of compiled code, and positions of a turn.
CALLS = (
    Motion(FOURBAR, 0.3, "dop853", 1e-8),
    Motion(FOURBAR, 0.3, "dopri5", 1e-6),
    Motion(FOURBAR, 0.1, "radau5", 1e-5),
    Motion(FOURBAR, 0.1, "rattle4", step=5e-3),
    Motion(ANDREWS, 0.002, "dop853", 1e-6),
    Motion(CHAIN, 0.1, "dop853", 1e-6),
    Motion("windows 2", 1.5, "dop853", 1e-6),
    Motion("windows 10", 0.5, "dop853", 1e-6),
    *(Driven(name, 73) for name in ("norton_fourbar", "stephenson_sixbar", "slider_crank")),
    *(Driven(name, 361) for name in ("norton_fourbar", "stephenson_sixbar", "slider_crank")),
    Beside(41),
)

#: Mechanisms whose symbolic phase is counted.
SYMBOLIC = (
    *(f"{shape} {count}" for shape in models.SHAPES for count in (10, 100)),
    *("n_windows_2", "n_windows_40", ANDREWS, FOURBAR, "watt_sixbar", "mud_pump", "scissor_lift"),
)

#: Mechanisms of the gallery whose pivots of the square Φ_q are counted, over a turn.
SQUARE = (
    *("norton_fourbar", "slider_crank", "quick_return", "stephenson_sixbar", "watt_sixbar"),
    *("hoekens", "mud_pump", "cam_follower", "planetary_train"),
)


def symbolic(model):
    """Sizes and lists of one system's elimination."""
    layout = mbody.assemble(made(model)).layout
    return {
        "nodes": int(layout.nodes),
        "slots": int(layout.slots),
        "blocks": len(layout.block_row),
        "formed": len(layout.form_block),
        "filled": len(layout.fill),
        "updates": len(layout.update),
    }


def square(model):
    """Numbers of one LU of the square Φ_q and of its solution."""
    system = mbody.assemble(made(model))
    mbody.kinetostatics(system, turn=True, instants=361)
    plan = system.plans["pivots"][0]
    return {
        "pivots": len(plan.pivot),
        "divisions": int((plan.unit == 0).sum()),
        "entries": len(plan.pivot) + len(plan.low) + len(plan.up),
        "filled": len(plan.fill),
        "changes": len(plan.change),
    }


# -- calls from Python ------------------------------------------------------------------------


def modules():
    """All modules of mbody but those of compiled functions."""
    for found in pkgutil.walk_packages(mbody.__path__, "mbody."):
        if not found.name.endswith("__main__") and not found.name.startswith("mbody.compiler"):
            importlib.import_module(found.name)
    kernels = {path for part in COMPILED for path in PACKAGE.glob(part)}
    for name, module in sorted(sys.modules.items()):
        file = getattr(module, "__file__", None)
        if name.partition(".")[0] == "mbody" and file and Path(file).resolve() not in kernels:
            yield module


@contextlib.contextmanager
def calls_from_python():
    """Counts of the calls of compiled functions from Python, by name, while it lasts."""
    counts, replaced = {}, []

    def counted(name, function):
        def call(*arguments):
            counts[name] = counts.get(name, 0) + 1
            return function(*arguments)

        return call

    for module in modules():
        for name, part in list(vars(module).items()):
            if hasattr(part, "py_func"):
                replaced.append((module, name, part))
                setattr(module, name, counted(part.py_func.__name__, part))
    try:
        yield counts
    finally:
        for module, name, part in replaced:
            setattr(module, name, part)
