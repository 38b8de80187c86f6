"""The commands about the compiled core: `mbody compile`, `mbody warmup`, `mbody doctor`."""

from __future__ import annotations

import importlib.metadata
import json
import os
import platform
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

from mbody.core.libraries import by_library
from mbody.core.tolerances import DOCTOR_ROUNDING

#: How programs without Python open images.
DOOR = ("mbody.h", "mbody.c")


def all_kernels() -> dict[str, Callable[..., Any]]:
    """Every kernel of mbody, by its name."""
    import pkgutil
    from importlib import import_module

    import mbody.kernels
    import mbody.laws.kernels
    import mbody.laws.smooth_contour
    from mbody.core.interface import KERNELS

    for module in pkgutil.iter_modules(mbody.kernels.__path__):
        import_module(f"mbody.kernels.{module.name}")
    return KERNELS


def compile_libraries(args: Any) -> int:
    """Build kernels as libraries: for other machines, C programs, browsers and co-simulation."""
    from importlib.util import find_spec

    from mbody.errors import ModelError
    from mbody.image.arena import TARGET

    if find_spec("numba") is None:
        raise ModelError(
            "libraries are built by numba, which is not installed: pip install 'mbody-planar[jit]'"
        )
    targets = args.target or ["host"]
    machines = [one for one in targets if one != TARGET]
    status = _for_machines(args, machines) if machines else 0
    if status == 0 and TARGET in targets:
        _for_browsers(Path(args.out))
    return status


def _for_machines(args: Any, targets: list[str]) -> int:
    """A library for each target; with ``--images`` an object file of the kernels that images call,
    and with ``--fmu`` the binary of co-simulation units. ``mbody.h`` and ``mbody.c``, by which C
    programs open images, are put beside.
    """
    import shutil

    from mbody.core.native_builder import builder_command, place, run_builder
    from mbody.image.arena import IMAGE_KERNELS
    from mbody.image.fmu import SHELL, SOURCES

    chosen: Any = IMAGE_KERNELS
    if not (args.images or args.fmu):
        chosen = [one for _, one in sorted(all_kernels().items())]
    first, *others = targets
    options = [word for other in others for word in ("--also", other)]
    if args.fmu:
        options += [word for name in SOURCES for word in ("--with", str(SHELL / name))]
    elif args.images:
        options.append("--object")
    names = [place(one) for one in chosen]
    command, settings = builder_command(names, first, Path(args.out), "--whole", *options)
    status = run_builder(command, settings, _steps_of(len(by_library(chosen)) + len(targets)))
    if status == 0 and not args.fmu:
        for name in DOOR:
            shutil.copyfile(SHELL / name, Path(args.out) / name)
    return status


def _steps_of(count: int) -> Callable[[str], None]:
    """Prints the step that is under way, of so many."""
    begun = iter(range(1, count + 1))
    return lambda name: print(f"building {name}, {next(begun)} of {count}", flush=True)


def _for_browsers(out: Path) -> None:
    """The kernels that images call as WebAssembly: a file, or in a folder; the ES module that loads
    it is put beside.
    """
    import shutil
    import tempfile

    from mbody.image.arena import FILE, IMAGE_KERNELS, MODULE, build_browser_core

    file = out if out.suffix == Path(FILE).suffix else out / FILE
    file.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(dir=file.parent) as folder:
        build_browser_core(Path(folder), _steps_of(len(by_library(IMAGE_KERNELS)) + 1))
        (Path(folder) / FILE).replace(file)
    shutil.copyfile(MODULE, file.parent / MODULE.name)


# -- `mbody warmup`: build or compile all kernels, once on a machine ---------------------------


def warmup(args: Any = None) -> int:
    """Build what the chosen core needs; later runs load it."""
    from mbody.core.selection import chosen

    core = chosen()
    if core.name == "native" and core.library is None:
        return _build()
    if core.name == "numba":
        return _compile()
    print(f"nothing to build: {core.reason}")
    return 0


def _build() -> int:
    """Build all kernels that are missing, in as many processes as there are cores."""
    from mbody.core.native import missing
    from mbody.core.native_builder import build

    start = time.perf_counter()
    all_kernels()
    wanted = missing()
    if wanted:
        build(wanted, os.cpu_count() or 1, _steps_of(len(by_library(wanted))))
    seconds = time.perf_counter() - start
    print(f"ready: {len(wanted)} kernels built in {seconds:.1f} s; later runs load them")
    return 0


def _compile() -> int:
    """Compile all kernels with numba by using every analysis on small models."""
    from mbody.core.decorators import compilations

    whole = time.perf_counter()
    for title, step in _steps():
        before, start = compilations(), time.perf_counter()
        print(f"{title} ...", end=" ", flush=True)
        step()
        seconds = time.perf_counter() - start
        print(f"{seconds:.1f} s, {compilations() - before} functions compiled", flush=True)
    seconds = time.perf_counter() - whole
    print(f"ready: {compilations()} functions compiled in {seconds:.1f} s; later runs load them")
    return 0


def _steps() -> Iterator[tuple[str, Callable[[], object]]]:
    from mbody.analysis.driven.driven import kinematics, kinetostatics, statics
    from mbody.analysis.driven.free_body import free_body
    from mbody.analysis.dynamics.simulate import simulate
    from mbody.analysis.equilibria.equilibrium import equilibrium
    from mbody.analysis.initial.close_loops import close_loops
    from mbody.analysis.linear.linearize import linearize
    from mbody.gallery import load
    from mbody.laws import Function
    from mbody.model.loads import Torque
    from mbody.sweeps import sweep
    from mbody.system.assembler import assemble

    model, swing = load("norton_fourbar"), load("simple_pendulum")
    times = [0.0, 0.01, 0.02]

    def batch() -> object:
        system = assemble(model).with_values({"crank.inertia": [0.4, 0.5, 0.6]})
        return kinetostatics(system, t=times).checks

    def designs() -> object:
        return sweep(model, {"crank.inertia": [0.4, 0.5]}, measure="motor.effort")

    def drifts() -> object:
        body = swing.bodies[0].name
        masses = {f"{body}.mass": [1.0, 2.0]}
        return sweep(swing, masses, "simulate", f"last({body}.angle)")

    def hooks() -> object:
        machine = load("norton_fourbar")
        machine.add(Torque("brake", "crank", value=Function(lambda t: 1.0 + t)))
        return kinetostatics(machine, t=times)

    yield "kinematics", lambda: kinematics(model, t=times)
    yield "kinetostatics", lambda: kinetostatics(model, t=times)
    yield "a whole turn", lambda: kinetostatics(model, turn=True, instants=400)
    yield "statics", lambda: statics(model)
    yield "loops", lambda: close_loops(model)
    yield "residuals", lambda: kinetostatics(model).checks
    yield "breakdown by cause", lambda: kinetostatics(model).breakdown("motor")
    yield "batches of designs", batch
    yield "sweeps", designs
    yield "functions of the user", hooks
    yield "free motion", lambda: simulate(swing)
    yield "free motions of designs", drifts
    yield "stiff motion", lambda: simulate(swing, method="radau5")
    yield "even steps", lambda: simulate(swing, method="rattle", step=0.01)
    yield "rest", lambda: equilibrium(swing)
    yield "small motions", lambda: linearize(swing, at=simulate(swing, 0.1))
    yield "free bodies", lambda: free_body(simulate(swing, 0.1), swing.bodies[0].name)


# -- `mbody doctor`: what is installed, which core runs the kernels, and whether they work -----

#: Packages by what they are for; the first group must be there.
NEEDED = {"numpy": "arrays", "pint": "units"}
EXTRA = {
    "numba": "building kernels on this machine",
    "pin": "cross-check by Pinocchio",
    "pymunk": "cross-check by pymunk",
    "mujoco": "cross-check by MuJoCo",
    "pandas": "run.to_dataframe()",
    "matplotlib": "draw and plot",
    "scipy": "cross-check: trajectories",
}
#: Driving torque of the gallery's `norton_fourbar` [lbf·in], from the book's nine equations solved
#: in extended precision (`tests/test_doctor.py`).
TORQUE = 243.23759076122957


def doctor(args: Any) -> int:
    """Report what is installed; 1 if something needed is missing."""
    report = examine()
    if args.json:
        print(json.dumps(report, ensure_ascii=False))
    else:
        print(*lines(report), sep="\n")
    return 0 if report["ready"] else 1


def examine() -> dict[str, Any]:
    """Versions, the core of the kernels, and whether mbody is ready."""
    from mbody.core.selection import chosen, source_hash

    core = chosen()
    needed = {name: _version(name) for name in NEEDED}
    checked = (
        kernel_check() if all(needed.values()) else _unchecked("not run: packages are missing")
    )
    ready = checked["agrees"] and sys.version_info >= (3, 11)
    found = {
        "python": platform.python_version(),
        "machine": f"{platform.system()} {platform.machine()}, {os.cpu_count()} cores",
        "needed": needed,
        "extra": {name: _version(name) for name in EXTRA},
        "core": core.name,
        "core_file": str(core.file) if core.file else None,
        "core_level": core.level,
        "core_hash": source_hash(),
        "core_reason": core.reason,
        "kernels": _kernels_built(),
        "kernel_check": checked,
        "ready": ready,
    }
    head = _head(found)
    return head | {"notes": [*head["notes"], *_notes_on_packages()]} | found


def _notes_on_packages() -> list[str]:
    """Notes on packages that are installed here."""
    from mbody.core.selection import namesake
    from mbody.engines.mujoco import faulty_release

    return [note for note in (namesake(), faulty_release(_version("mujoco") or "")) if note]


def _kernels_built() -> int | None:
    """How many kernels the cache folder has; None where it need not have any."""
    from mbody.core.native import missing
    from mbody.core.selection import chosen

    if chosen().name != "native" or chosen().library is not None:
        return None
    return len(all_kernels()) - len(missing())


def _head(found: dict[str, Any]) -> dict[str, Any]:
    """The first keys of the report; that mbody is not ready is a doubt about its results."""
    from mbody.solution.doubts import Doubt, Inherited, heading, inherited

    doubts = () if found["ready"] else (Doubt("solver", _remedy(found)),)
    whole = Inherited(**inherited(Inherited(doubts=doubts)))
    return heading(None, "doctor", {"torque": "lbf·in"}, whole)


def kernel_check() -> dict[str, Any]:
    """Run the kernels on a model of the gallery and compare one number: ``{"value", "expected",
    "agrees", "error"}``. The first run on a machine compiles them.
    """
    try:
        from mbody.analysis.driven.driven import kinetostatics
        from mbody.gallery import load

        value = float(kinetostatics(load("norton_fourbar")).effort("motor")[0])
    except Exception as error:  # whatever a package of another version raises
        return _unchecked(f"{type(error).__name__}: {error}")
    agrees = abs(value - TORQUE) <= DOCTOR_ROUNDING * TORQUE
    return {"value": value, "expected": TORQUE, "agrees": agrees, "error": None}


def _unchecked(why: str) -> dict[str, Any]:
    return {"value": None, "expected": TORQUE, "agrees": False, "error": why}


def _version(package: str) -> str | None:
    try:
        return importlib.metadata.version(package)
    except importlib.metadata.PackageNotFoundError:
        return None


def lines(report: dict[str, Any]) -> list[str]:
    """The report for people."""
    found = [
        f"mbody       {report['mbody']}",
        f"Python      {report['python']}",
        f"machine     {report['machine']}",
        "",
    ]
    for name, purpose in NEEDED.items():
        version = report["needed"][name]
        found.append(f"{name:<12}{version or 'MISSING: pip install ' + name:<12}{purpose}")
    for name, purpose in EXTRA.items():
        version = report["extra"][name]
        found.append(f"{name:<12}{version or '–':<12}{purpose}")
    found.append("")
    found.append(f"core        {report['core']}: {report['core_reason']}")
    if report["core_file"] is not None:
        kept = "" if report["kernels"] is None else f"{report['kernels']} kernels in "
        found.append(f"            {kept}{report['core_file']}, for {report['core_level']}")
    check = report["kernel_check"]
    if check["error"] is not None:
        found.append(f"            the kernels do not run: {check['error']}")
    else:
        verdict = "agrees with" if check["agrees"] else "IS NOT"
        found.append(
            f"            a torque of {check['value']:.12g} {verdict} {TORQUE:.12g} lbf·in"
        )
    doubted = [doubt["message"] for doubt in report["doubts"]]
    found += [f"note        {note}" for note in report["notes"] if note not in doubted]
    found += ["", "ready" if report["ready"] else _remedy(report)]
    return found


def _remedy(report: dict[str, Any]) -> str:
    """Verdict on the installation, with its remedy."""
    if not all(report["needed"].values()):
        return "NOT READY: install what is missing"
    if report["kernel_check"]["error"] is not None:
        return (
            "NOT READY: the kernels do not run with these versions: install those of "
            "constraints.txt, delete the folder of kernels, or try MBODY_CORE=numba"
        )
    return "NOT READY: the kernels compute wrongly on this processor: please report this output"
