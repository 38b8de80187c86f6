"""Commands that analyse a model: motion, forces, equilibria, modes, assemblies, cross-checks."""

from __future__ import annotations

import json
import sys
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from mbody.cli.interrupts import interrupt
from mbody.cli.parser import equal_steps, given, model_of, named_values, path_of, plain_angle
from mbody.cli.streams import PRINTED, UsageError, check_printed, message
from mbody.errors import ModelError, SolveError
from mbody.model.numbers import number_in
from mbody.quantities.output_units import OutputUnits
from mbody.solution.doubts import heading, succeeded

if TYPE_CHECKING:
    from mbody.analysis.assemblies.assembly_modes import AssemblyModes
    from mbody.model.mechanism import Mechanism
    from mbody.model.simulation import Instants
    from mbody.solution.solution import Solution
    from mbody.system.system import System


def analyse(args: Any) -> int:
    """Run an analysis and print its results."""
    from mbody.analysis.driven.driven import analyse_at as solved
    from mbody.summaries.instant import efficiency_line
    from mbody.summaries.text_table import noted

    files = files_of(args)
    mechanism = model_of(args)
    wanted = question(args, mechanism.ask)
    run = solved(mechanism, args.command, wanted, assembly_of(args))
    wants_equations = getattr(args, "equations", False)
    if wants_equations and len(run) > 1:
        raise ModelError("--equations shows one instant: choose it with --at")
    write(run, args, files)
    output = getattr(args, "efficiency", None)
    found = run.efficiency(output) if output else None
    if args.json:
        data = run.data()
        if found is not None:
            keys = "value", "given", "useful", "lost"
            data["efficiency"] = {key: getattr(found, key) for key in keys}
            data["notes"] = list(dict.fromkeys((*data["notes"], *found.notes)))
        if wants_equations:
            data["equations"] = run.equations().data()
        print_data(data)
    elif wants_equations:
        print(run.equations())
    elif args.csv != "-":
        print(run)
        if found is not None and output:
            print("\n".join([efficiency_line(run, output, found), *noted(found.notes)]))
    return exit_status(run, printed=args.json or (args.csv != "-" and not wants_equations))


def print_data(data: Mapping[str, Any]) -> None:
    """Data in place of text."""
    print(json.dumps(data, ensure_ascii=False, allow_nan=False))


def head_of(
    mechanism: Mechanism, command: str, found: Any, units: OutputUnits | None = None
) -> dict[str, Any]:
    """The first keys of the data of a command, in the units of the model or in others."""
    symbols = (units or OutputUnits(mechanism.units)).symbols()
    return heading(mechanism.name, command, symbols, found)


def answered(
    args: Any,
    found: Any,
    data: Callable[[], Mapping[str, Any]] | None = None,
    printed: bool = False,
) -> int:
    """Print a result, or its data; its exit status. `printed`: whether its text has the notes."""
    if args.json:
        print_data(data() if data else found.data(getattr(args, "angle", None)))
    else:
        print(found)
    return exit_status(found, printed=printed or args.json)


def exit_status(result: Any, printed: bool = True) -> int:
    """The exit status of a result; what it says of itself goes to stderr unless it is `printed`
    on stdout.
    """
    if not printed:
        for doubt in result.doubts:
            message(f"mbody: doubtful: {doubt.message}")
        doubtful = {doubt.message for doubt in result.doubts}
        for note in result.notes:
            if note not in doubtful:
                message(f"note: {note}")
    return 0 if succeeded(result.status) else 1


def question(args: Any, own: Instants | None) -> Instants | None:
    """The instants that the arguments ask for, or those of the model."""
    from mbody.model.simulation import Instants

    if args.at and args.over:
        raise UsageError("give --at or --over, not both")
    counts = [f"--{name}" for name in ("instants", "turns") if getattr(args, name) is not None]
    if args.at and counts:
        raise UsageError(
            f"{counts[0]} is of whole turns, --at of single instants: give one of them; in equal "
            "steps --at crank=0:360:25"
        )
    over = args.over or (own.over if own and not args.at else "") or ("turn" if counts else "")
    if args.over or counts:
        turns = args.turns
        if turns is None:
            turns = own.turns if own and not args.over else 1
        try:
            return Instants(over=over, instants=args.instants, turns=turns)
        except ModelError as error:
            raise ModelError(str(error).replace("ask: ", "--", 1)) from None
    at: dict[str, Any] = {}
    for name, text in named_values(args.at, "--at").items():
        parts = equal_steps(f"--at {name}", text)
        at[name] = [plain_angle(f"--at {name}", part) for part in parts]
    return Instants(at=at) if at else own


def assembly_of(args: Any) -> str | int | None:
    """The assembly mode of the arguments: a number, or a name."""
    text: str | None = args.assembly
    if text is not None and text.isascii() and text.isdigit():
        return int(text[:9])
    return text


#: Files of a result by their ending, as -o takes them.
FORMS = ("xlsx", "csv", "npz", "json", "parquet")


def files_of(args: Any) -> dict[str, str]:
    """The requested files by their form; outputs that would mix are refused before an analysis."""
    found = {form: getattr(args, form) for form in ("csv", "npz", "xlsx") if getattr(args, form)}
    if args.output:
        ending = args.output.rpartition(".")[2].lower()
        if ending not in FORMS:
            raise UsageError(
                f"-o writes a table by its ending, .xlsx, .csv, .npz, .json or .parquet, which "
                f"'{args.output[:60]}' has not; pictures are of mbody freebody, report and view"
            )
        if ending in found:
            raise UsageError(f"give -o {args.output[:60]} or --{ending}, not both")
        found[ending] = args.output
    args.csv = found.get("csv")
    check_printed(args)
    for form in ("npz", "xlsx"):
        if found.get(form) == PRINTED:
            raise UsageError(f"--{form} takes a file: it cannot be printed")
    return found


def write(run: Solution, args: Any, files: Mapping[str, str]) -> None:
    """Write the requested files and report them."""
    for form, path in files.items():
        if path == PRINTED:
            from mbody.files.tables import print_csv

            print_csv(run, sys.stdout)
            continue
        options = {"excel": args.excel} if form == "csv" else {}
        getattr(run, f"to_{form}")(path, **options)
        message(f"wrote {path}: {len(run)} instants")


# -- Commands about models: `check`, `equilibrium`, `modes`, `models`, `show`, `schema` --------

#: Boxes that `check` searches for assembly modes: most need 50, a family of positions 5000.
AT_ONCE = 6000


def check(args: Any) -> int:
    """Degrees of freedom, redundant rows and free motions of a model."""
    from mbody.analysis.freedom.mobility import mobility
    from mbody.summaries.analyses import closing_data, closing_line

    mechanism = model_of(args)
    report = mobility(mechanism, _when(args, mechanism))
    found = _assemblies(mechanism) if report.drivers and report.driven.freedom == 0 else None
    if args.json:
        closing = None if found is None else closing_data(found)
        print(json.dumps(report.data() | {"assemblies": closing}, ensure_ascii=False))
        return 0
    print(report)
    if found is not None:
        print("", *closing_line(found), sep="\n")
    return 0


def _assemblies(mechanism: Mechanism) -> AssemblyModes | None:
    """In how many ways the mechanism closes, as far as that is known at once."""
    from mbody.analysis.assemblies.assembly_modes import assembly_modes

    try:
        return assembly_modes(mechanism, most=AT_ONCE)
    except SolveError:
        return None


def equilibrium(args: Any) -> int:
    """Equilibria of a model."""
    from mbody.analysis.equilibria.equilibrium import equilibrium as found

    mechanism = model_of(args)
    report = found(mechanism, **_about_rest(args, mechanism))
    angle = args.angle or "deg"
    return answered(args, report, lambda: report.data(angle), printed=True)


def modes(args: Any) -> int:
    """Frequencies, damping and shapes of small motions about the equilibria of a model."""
    from mbody.analysis.linear.modes import modes as found

    mechanism = model_of(args)
    report = found(mechanism, **_about_rest(args, mechanism))
    return answered(args, report, report.data, printed=True)


def _when(args: Any, mechanism: Mechanism) -> float:
    """The time at which laws are evaluated."""
    return 0.0 if args.t is None else number_in(mechanism, args.t, "time", "--t", "value")


def _about_rest(args: Any, mechanism: Mechanism) -> dict[str, Any]:
    """The arguments of analyses about rest."""
    found: dict[str, Any] = {"free": args.free, "t": _when(args, mechanism)}
    if args.guess:
        found["starts"] = _guesses(mechanism, args.guess)
    return found


def _guesses(mechanism: Mechanism, texts: list[str]) -> dict[str, float]:
    """First angles of bodies [rad] by name."""
    return {
        name: number_in(mechanism, plain_angle("--guess", text), "angle", name, "--guess")
        for name, text in named_values(texts, "--guess").items()
    }


def models(args: Any) -> int:
    """The models of the gallery, with title, source and what to look at."""
    from mbody import gallery
    from mbody.summaries.text_table import paragraph

    found = {name: _headed(gallery.path(name)) for name in gallery.names()}
    if args.json:
        entries = [{"model": name, **head} for name, head in found.items()]
        head = heading(None, "models", {})
        print(json.dumps(head | {"models": entries}, ensure_ascii=False))
        return 0
    wide = max(map(len, found)) + 2
    for name, head in found.items():
        parts = [part for line in head.values() if line for part in paragraph(line, " " * wide)]
        print(f"{name:{wide}}{parts[0].lstrip()}", *parts[1:], "", sep="\n")
    print("mbody kinetostatics NAME analyses one, mbody show NAME prints its file")
    return 0


def _headed(path: Path) -> dict[str, str]:
    """Title, source and note of a file: nothing of it is made, so that names are there at once."""
    import tomllib

    table = tomllib.loads(path.read_text(encoding="utf-8"))
    keys = {"title": "name", "source": "source", "note": "note"}
    return {word: str(table.get(key, "")) for word, key in keys.items()}


def show(args: Any) -> int:
    """The file of a model, as it is."""
    from mbody.files.model.read import text_of

    print(text_of(path_of(args.model)), end="")
    return 0


def schema(args: Any) -> int:
    """The JSON Schema of model files."""
    from mbody.files.model import json_schema

    print(json.dumps(json_schema(), indent=2, ensure_ascii=False))
    return 0


# -- `mbody simulate MODEL`: free motion over time ---------------------------------------------


def simulate(args: Any) -> int:
    """Simulate the motion and print it; 1 if it was stopped or is in doubt."""
    from mbody.analysis.dynamics.simulate import simulate as simulated

    files = files_of(args)
    mechanism = model_of(args)
    options: dict[str, Any] = {"progress": _progress(args, _last(mechanism, args.to))}
    options |= given(args, "method", "rtol", "atol", "instants")
    for name, text in given(args, "step", "every").items():
        options[name] = number_in(mechanism, text, "time", "simulate", f"--{name}")
    if args.times:
        parts = [part for text in args.times for part in equal_steps("--times", text)]
        options["times"] = [number_in(mechanism, one, "time", "--times", "t") for one in parts]
    if args.guess:
        options["guess"] = _guesses(mechanism, args.guess)
    for name in ("rates", "release"):
        if texts := named_values(getattr(args, name), f"--{name}"):
            options[name] = texts
    if texts := named_values(args.input, "--input"):
        options["inputs"] = {name: _history(name, text) for name, text in texts.items()}
    if args.begun is not None:
        from mbody.files.saved import load_run

        options["start"] = load_run(args.begun)
    run = simulated(mechanism, args.to, **options)
    interrupt.done()
    write(run, args, files)
    if args.save is not None:
        from mbody.files.saved import save_run

        save_run(run, args.save)
        message(f"wrote {args.save}: {len(run)} instants")
    if args.json:
        print_data(run.data())
    elif args.csv != "-":
        print(run)
    return exit_status(run, printed=args.json or args.csv != "-")


def _history(name: str, text: str) -> Any:
    """A history as text, or the rows t and u of a file."""
    if not text.startswith("@"):
        return text
    from mbody.files.model.csv_columns import columns

    path = Path(text[1:])
    try:
        return columns(path.name, path.parent)
    except ModelError as error:
        why = str(error).replace(" beside the model", "")
        raise ModelError(f"--input {name}: {why}", name) from None


def _last(mechanism: Any, to: Any) -> float:
    """End of the motion; the analysis refuses a motion without one."""
    args = to if to is not None or mechanism.simulation is None else mechanism.simulation.until
    return 0.0 if args is None else number_in(mechanism, args, "time", "simulate", "until")


def _progress(args: Any, until: float) -> Callable[[float], None]:
    """A function that shows the time reached on a terminal, and stops the motion at Ctrl-C."""
    from mbody.analysis.dynamics.interruptions import progress_display

    shows = not args.json and sys.stderr is not None and sys.stderr.isatty()
    show = progress_display(until) if shows else None

    def progress(t: float) -> None:
        interrupt.mark()
        if show is not None:
            show(t)

    return progress


# -- `mbody assemblies MODEL`: every way in which a mechanism closes ---------------------------


def assemblies(args: Any) -> int:
    """Print assembly modes, circuits and dead centres, and draw the modes."""
    from mbody.analysis.assemblies.assembly_modes import assembly_modes
    from mbody.analysis.assemblies.circuits import circuits
    from mbody.system.assembler import assemble
    from mbody.views.labels import check_ending

    if args.output:
        check_ending(args.output)
    args.over = args.instants = args.turns = None
    mechanism = model_of(args)
    system = assemble(mechanism)
    wanted = question(args, None)
    drive, used = _values(system, wanted)
    found: Any
    if system.independent_drivers:
        name = args.driver or system.independent_drivers[0].name
        found = circuits(system, drive, driver=name, used=used)
    else:
        found = assembly_modes(system, **given(args, "most"))
    if args.output:
        from mbody.views import save
        from mbody.views.drawing import draw_assemblies

        save(draw_assemblies(found if not system.independent_drivers else found.modes), args.output)
        message(f"wrote {args.output}")
    more: dict[str, Any] = (
        {} if system.independent_drivers else {"circuits": [], "dead_centres": []}
    )
    return answered(args, found, lambda: found.data(args.angle or "deg") | more)


def _values(system: System, wanted: Instants | None) -> tuple[dict[str, float], np.ndarray | None]:
    """Values of the drivers at the one instant requested, and the position that analyses find."""
    from mbody.analysis.driven.driven import analyse_system_at, arguments_at
    from mbody.model.simulation import Instants

    if wanted is None:
        return {}, None
    how, _ = arguments_at(system, wanted)
    if "t" in how:
        times = np.asarray(how["t"])[1:]
        values = {
            d.name: [float(system.law_of(d)(float(t))) for t in times]
            for d in system.independent_drivers
        }
    else:
        values = {name: np.asarray(row)[1:].tolist() for name, row in how["drive"].items()}
    if max(map(len, values.values()), default=1) != 1:
        raise UsageError("assemblies are those of one position: give --at one value")
    drive = {name: row[0] for name, row in values.items()}
    try:
        run = analyse_system_at(system, "kinematics", Instants(at=wanted.at))
    except SolveError:
        return drive, None
    return drive, np.concatenate(
        [np.asarray(run.record.table(slice(None))[0, : run.system.coordinates]), np.zeros(3)]
    )


# -- `mbody transmission MODEL --output BODY`: how well a force comes through ------------------


def transmission(args: Any) -> int:
    """Print transmission angle, mechanical advantage and velocity ratio, over the turn; of an
    output that another link drives by contact, over the motion of its simulation.
    """
    from mbody.analysis.driven.driven import analyse_at
    from mbody.analysis.driven.transmission import transmission as found_through
    from mbody.views.shapes import cycle

    mechanism = model_of(args)
    wanted = question(args, mechanism.ask)
    if wanted is None and _by_contact(mechanism, args.output):
        from mbody.analysis.dynamics.simulate import simulate

        run = simulate(mechanism)
    else:
        if not args.at and not args.over:
            wanted = cycle(mechanism, wanted)
        run = analyse_at(mechanism, "kinematics", wanted, assembly_of(args))
    found = found_through(run, args.driver, args.output, args.joint)
    return answered(args, found, lambda: found.data(args.angle or "deg"))


def _by_contact(mechanism: Mechanism, output: str) -> bool:
    """Whether contacts with another moving link, which open and close, drive the output."""
    from mbody.system.assembler import assemble

    if mechanism.simulation is None or not (mechanism.contacts or mechanism.groups):
        return False
    body = output.partition(".")[0]
    every = assemble(mechanism).mechanism.contacts  # those of groups, too
    touching = (one.bodies for one in every if len(one.bodies) == 2)
    return any(body in pair and "ground" not in pair for pair in touching)


# -- `mbody crosscheck MODEL`: its results compared with those of other engines ----------------


def crosscheck(args: Any) -> int:
    """Check a model against other engines; 1 where one of them differs."""
    from mbody.engines.crosscheck import crosscheck as checked

    report = checked(model_of(args), args.against or None)
    return answered(args, report, report.data, printed=True)
