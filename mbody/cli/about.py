"""Commands about models: `check`, `equilibrium`, `modes`, `models`, `show`, `schema`."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

from mbody.cli.analyse import exit_status
from mbody.cli.models import model_of, path_of
from mbody.errors import SolveError
from mbody.solution.heading import heading

if TYPE_CHECKING:
    from mbody.analysis.assemblies.assembly_mode import AssemblyModes
    from mbody.model.mechanism import Mechanism

__all__ = ["check", "equilibrium", "models", "modes", "schema", "show"]

#: Boxes that `check` searches for assembly modes: most need 50, a family of positions 5000.
AT_ONCE = 6000


def check(args: Any) -> int:
    """Degrees of freedom, redundant rows and free motions of a model."""
    from mbody.analysis.freedom.mobility import mobility
    from mbody.sheets.assemblies import closing_data, closing_line

    mechanism = model_of(args)
    report = mobility(mechanism)
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
    """Rest positions of a model."""
    from mbody.analysis.equilibria.equilibrium import equilibrium as found
    from mbody.model.numbers import number_in

    mechanism = model_of(args)
    when = 0.0 if args.t is None else number_in(mechanism, args.t, "time", "--t", "value")
    report = found(mechanism, free=args.free, t=when)
    angle = args.angle or "deg"
    print(json.dumps(report.data(angle), ensure_ascii=False) if args.json else report)
    return exit_status(report)


def modes(args: Any) -> int:
    """Frequencies, damping and shapes of small motions about the rest positions of a model."""
    from mbody.analysis.linear.modes import modes as found
    from mbody.model.numbers import number_in

    mechanism = model_of(args)
    when = 0.0 if args.t is None else number_in(mechanism, args.t, "time", "--t", "value")
    report = found(mechanism, free=args.free, t=when)
    print(json.dumps(report.data(), ensure_ascii=False) if args.json else report)
    return exit_status(report)


def models(args: Any) -> int:
    """The models of the gallery, with title, source and what to look at."""
    from mbody import gallery
    from mbody.sheets.text_table import paragraph

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
