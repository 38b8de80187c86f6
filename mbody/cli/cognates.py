"""`mbody cognates MODEL --point coupler.P`: other linkages with the same coupler curve."""

from __future__ import annotations

import json
from typing import Any

from mbody.cli.models import model_of
from mbody.cli.streams import message
from mbody.cli.synthesize import numbered_file
from mbody.solution.heading import heading, unit_symbols

__all__ = ["cognates"]


def cognates(args: Any) -> int:
    """Print the cognates, and write them as model files."""
    from mbody.synthesis import cognates as cognates_of

    mechanism = model_of(args)
    found = cognates_of(mechanism, args.point)
    files = [numbered_file(args.output, n) for n in range(len(found))] if args.output else []
    for one, file in zip(found, files, strict=False):
        one.save(file)
        message(f"wrote {file}")
    if args.json:
        rows = [{"file": files[n] if files else None} | one.data() for n, one in enumerate(found)]
        head = heading(mechanism.name, "cognates", unit_symbols(mechanism.units))
        data = head | {"point": args.point, "first": found.first.data(), "cognates": rows}
        print(json.dumps(data | {"notes": list(found.notes)}, ensure_ascii=False, allow_nan=False))
    else:
        print(found)
    return 0
