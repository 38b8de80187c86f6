"""Building the straight-line code of one topology: a program, run in a process of its own.

    python -m mbody.straight_line.code_builder DESCRIPTION --target host --to LIBRARY --sources HASH

The description is what `mbody.straight_line.programs` wrote. The process has the plain core: the
kernels' functions run as they are written, on recorded numbers. It ends with 3 where what they do
depends on numbers, so that there is no straight-line code.
"""

# mypy: disallow-any-unimported=False, disallow-untyped-calls=False

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import llvmlite.binding as llvm
import numpy as np
from llvmlite import ir

from mbody.compiler.builder import emit, machine_of, needed
from mbody.compiler.c_interface import common
from mbody.compiler.targets import TARGETS, Target
from mbody.core.recorded_numbers import Untraceable
from mbody.straight_line.compiled_functions import DesignsWriter, MotionWriter
from mbody.straight_line.pieces import NONE, Description, recorded_pieces
from mbody.straight_line.whole_function import lanes_of


def described(file: Path) -> Description:
    """The description in a file."""
    parts: dict[str, dict[str, Any]] = {}
    with np.load(file) as arrays:
        for name in arrays.files:
            part, _, field = name.partition(".")
            array = arrays[name]
            parts.setdefault(part, {})[field] = array if array.ndim else array[()].item()
    pivots = sorted(part for part in parts if part.startswith("pivots"))
    return Description(
        layout=SimpleNamespace(**parts["layout"]),
        squares=tuple(SimpleNamespace(**parts[part]) for part in pivots),
        path=SimpleNamespace(**parts["path"]),
        initial=parts["initial"],
    )


def straight_line_module(target: Target, one: Description, sources: str, lanes: int) -> Any:
    """The optimised module of one topology, with so many lanes."""
    machine = machine_of(target)
    layout = str(machine.target_data)
    module = ir.Module("straight_line")
    module.triple, module.data_layout = target.triple, layout
    writer = MotionWriter if one.path.pieces else DesignsWriter
    initial = writer(module, one, *recorded_pieces(one), lanes=lanes).initial
    made = llvm.parse_assembly(str(module))
    table = json.dumps({"initial": initial, "needs": needed(made)})
    made.link_in(llvm.parse_assembly(str(common(target.triple, layout, sources, table))))
    options = llvm.create_pipeline_tuning_options(speed_level=3)
    options.loop_vectorization = options.slp_vectorization = False
    passes = llvm.create_pass_builder(machine, options)
    passes.getModulePassManager().run(made, passes)
    made.verify()
    return made


def main() -> int:
    """The program."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("description", type=Path)
    parser.add_argument("--target", default="host", choices=list(TARGETS))
    parser.add_argument("--to", type=Path, required=True)
    parser.add_argument("--sources", default="")
    parser.add_argument("--lanes", type=int, choices=[4, 8], help="default: by the processor")
    options = parser.parse_args()
    target = TARGETS[options.target]
    lanes = options.lanes or lanes_of(target)
    try:
        one = described(options.description)
        module = straight_line_module(target, one, options.sources, lanes)
    except Untraceable as error:
        print(error)
        return NONE
    emit(target, module, options.to)
    return 0


if __name__ == "__main__":
    sys.exit(main())
