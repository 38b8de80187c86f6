"""mbody: planar multibody dynamics. Describe a mechanism, get its motion and every joint force.

>>> import mbody
>>> machine = mbody.makers.four_bar(1.0, 3.0, 2.0, 3.5, masses=(1.0, 3.0, 2.0), speed=10.0)
>>> run = mbody.kinetostatics(machine)
>>> round(float(run["crank"].omega[0]), 6)
10.0

These names are for every user, with the folders `mbody.laws`, `mbody.makers`, `mbody.gallery`,
`mbody.engineering`, `mbody.envs`, `mbody.sweeps`, `mbody.synthesis`, `mbody.teaching` and
`mbody.testing`.
"""

from __future__ import annotations

import importlib

from mbody._version import __version__ as __version__
from mbody.core import presentation, registered

registered.compiler, registered.builder = "mbody.compiler.install", "mbody.compiler.builder"

presentation.register(
    "summary",
    Answer="mbody.summaries.analyses:answers_summary",
    AssemblyModes="mbody.summaries.analyses:assemblies_summary",
    Circuits="mbody.summaries.analyses:circuits_summary",
    Crosscheck="mbody.summaries.analyses:crosscheck_summary",
    DeadCentres="mbody.summaries.analyses:dead_centres_summary",
    Equations="mbody.summaries.equations:summary",
    Equilibria="mbody.summaries.analyses:equilibrium_summary",
    EquilibriumCurve="mbody.summaries.analyses:curve_summary",
    Mobility="mbody.summaries.analyses:mobility_summary",
    Modes="mbody.summaries.analyses:modes_summary",
    Presented="mbody.summaries.text_table:summary",
    Solution="mbody.summaries.instant:summary",
)
presentation.register(
    "data",
    Answer="mbody.files.results:answer_data",
    Presented="mbody.solution.declared_result:result_data",
    Solution="mbody.files.results:data",
)
presentation.register(
    "notebook",
    Mechanism="mbody.views.notebook_html:html_of",
    Presented="mbody.views.notebook_html:html_of",
    Sweep="mbody.views.notebook_html:html_of",
    System="mbody.views.notebook_html:html_of",
)
presentation.register("certificate", Solution="mbody.solution.checks:certificate_of")
presentation.register("drawing", FreeBody="mbody.views.free_bodies:draw_free_body")
presentation.register("equations", Solution="mbody.summaries.equations:system_of_equations")
presentation.register("derivation", Solution="mbody.teaching.derivation:derivation_as")
presentation.register("columns", Solution="mbody.files.tables:columns")
presentation.register("table", Solution="mbody.solution.result_table:result_table")
presentation.register("dataframe", Solution="mbody.files.tables:dataframe")
presentation.register("at", Solution="mbody.analysis.dynamics.simulate:repeated_at")
presentation.register("efficiency", Solution="mbody.analysis.driven.free_body:efficiency")
presentation.register("known_of", Solution="mbody.solution.known_forces:known_of")
presentation.register("move_forces", Solution="mbody.analysis.driven.open_forces:move_forces")
presentation.register("open_forces", Solution="mbody.analysis.driven.open_forces:open_forces")
presentation.register("followed_forces", Solution="mbody.solution.known_forces:followed_forces")
presentation.register("open_forces_note", Solution="mbody.solution.known_forces:open_forces_note")
presentation.register("sensitivity", Solution="mbody.derivatives.gradient:sensitivity")
presentation.register("then", Solution="mbody.analysis.dynamics.simulate:then")
presentation.register("xarray", Solution="mbody.files.tables:dataset")
presentation.register("csv", Solution="mbody.files.tables:write_csv")
presentation.register("json", Solution="mbody.files.results:write_json")
presentation.register("xlsx", Solution="mbody.files.tables:write_xlsx")
presentation.register("parquet", Solution="mbody.files.tables:write_parquet")
presentation.register("npz", Solution="mbody.files.results:write_npz")

#: Public names by their module: those of the stub that type checkers read. A name is loaded when it
#: is first used, so that `import mbody` takes no time; a folder is a module itself.
_STUB = __spec__.loader.get_data(__file__.removesuffix("c") + "i").decode()
_LINES = (line.split() for line in _STUB.splitlines() if line.startswith("from "))
_HOMES = {words[-1]: words[1] for words in _LINES if words[-1] != "__version__"}
__all__ = [name for name, home in _HOMES.items() if home != "mbody"]


def __getattr__(name: str) -> object:
    home = _HOMES.get(name)
    if home == "mbody":
        return importlib.import_module(f"mbody.{name}")
    if home:
        value = getattr(importlib.import_module(home), name)
        globals()[name] = value
        return value
    from mbody.core.former_names import former

    raise AttributeError(former(f"mbody.{name}") or f"module 'mbody' has no attribute '{name}'")


def __dir__() -> list[str]:
    return sorted(__all__)
