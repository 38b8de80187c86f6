"""The fingerprint of a sweep: digests of model, numbers, designs, instants and measures."""

from __future__ import annotations

import hashlib
import json
from typing import Any

import numpy as np

from mbody._version import __version__
from mbody.sweeps.job import Job
from mbody.sweeps.samples import DesignNumbers

__all__ = ["digest_of", "fingerprint"]


def fingerprint(job: Job, samples: DesignNumbers, size: int) -> dict[str, Any]:
    """What must be equal for results to belong to the same sweep.

    Parameters
    ----------
    job : Job
        The analysis and its measures.
    samples : DesignNumbers
        The designs.
    size : int
        Designs of a piece.

    Returns
    -------
    dict
        Plain values, ready for JSON: the content of ``sweep.json``.
    """
    system, machine = job.system, job.system.mechanism
    plan = [] if job.grid is None else [job.grid.s, job.grid.t, job.grid.given]
    how = sorted((k, getattr(v, "tolist", lambda v=v: v)()) for k, v in job.how.items())
    # formulas and guesses are not in the kernels' arrays, but they affect the other designs
    made = sorted((name, formula.text) for name, formula in system.formulas.items())
    guesses = [(body.name, repr(body.guess)) for body in machine.bodies]
    measures = sorted((name, repr(measure)) for name, measure in machine.measures.items())
    return {
        "model": _digest(
            *system.layout.as_dict().values(),
            system.par,
            system.mass,
            sorted(system.values.items()),
            made,
            guesses,
            measures,
            machine.units.name,
            [_code(function) for _, function in system.functions],
        ),
        "parameters": [*samples.given_names],
        "samples": _digest(samples.values),
        "designs": len(samples.values),
        "analysis": job.analysis,
        "instants": _digest(job.before, *plan, how, machine.simulation),
        "measures": [
            [c.name, c.measure.of, unit, c.by, c.instant]
            for c, unit in zip(job.columns, job.units, strict=True)
        ],
        "piece": size,
        "version": __version__,
    }


def digest_of(content: dict[str, Any]) -> str:
    """One digest of all of an fingerprint, which every piece carries.

    >>> len(digest_of({"analysis": "statics"}))
    64
    """
    return hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()


def _digest(*parts: Any) -> str:
    made = hashlib.sha256()
    for part in parts:
        array = np.ascontiguousarray(part) if isinstance(part, np.ndarray) else None
        made.update(repr(part).encode() if array is None else array.tobytes())
        made.update(b"|" if array is None else f"{array.shape}|".encode())
    return made.hexdigest()


def _code(function: Any) -> Any:
    """Name, instructions and plain constants of a user's function."""
    while hasattr(function, "function"):  # as the hook of the kernels wraps it
        function = function.function
    name = getattr(function, "__qualname__", str(type(function)))
    code = getattr(function, "__code__", None)
    return (name, None if code is None else _instructions(code))


def _instructions(code: Any) -> Any:
    plain = [part for part in code.co_consts if not hasattr(part, "co_code")]
    inner = [_instructions(part) for part in code.co_consts if hasattr(part, "co_code")]
    return (code.co_code, repr(plain), code.co_names, inner)
