"""What FMPy says of a unit: a program of its own, in an environment with fmpy and without mbody.

    python fmpy_judge.py UNIT.fmu REQUEST.json ANSWER.json

REQUEST: stop, step, and optionally tolerance, start (values by name), input (columns by name, with
"time"), outputs (names). ANSWER: problems, columns, size of a state, whether a state that is set
back leads to the same bits, whether mbody or numba were loaded.
"""

import ctypes
import json
import sys
import tempfile

import numpy as np
from fmpy import extract, read_model_description, simulate_fmu
from fmpy.fmi2 import FMU2Slave
from fmpy.fmi3 import FMU3Slave
from fmpy.validation import validate_fmu


def columns(unit, asked):
    """A simulation as FMPy makes it."""
    given = asked.get("input")
    signals = None
    if given:
        names = list(given)
        signals = np.array(
            list(zip(*given.values(), strict=True)), dtype=[(name, float) for name in names]
        )
    run = simulate_fmu(
        unit,
        stop_time=asked["stop"],
        step_size=asked["step"],
        output_interval=asked["step"],
        relative_tolerance=asked.get("tolerance"),
        start_values=asked.get("start", {}),
        input=signals,
        output=asked["outputs"],
        use_event_mode=asked.get("events", False),
    )
    return {name: run[name].tolist() for name in run.dtype.names}


def begun(unit, folder, about, asked):
    """An instance at the beginning of its motion."""
    two = about.fmiVersion == "2.0"
    made = (FMU2Slave if two else FMU3Slave)(
        guid=about.guid,
        unzipDirectory=folder,
        modelIdentifier=about.coSimulation.modelIdentifier,
        instanceName="one",
    )
    made.instantiate()
    if two:
        made.setupExperiment(startTime=0.0)
        made.enterInitializationMode()
    else:
        made.enterInitializationMode(startTime=0.0)
    made.exitInitializationMode()
    return made


def read(unit, references):
    """Values of all variables."""
    get = unit.getReal if hasattr(unit, "getReal") else unit.getFloat64
    return [float(value) for value in get(references)]


def same_bits(unit, asked):
    """Whether a state that is set back repeats a motion; and how many bytes it has."""
    about = read_model_description(unit)
    folder, step = extract(unit, tempfile.mkdtemp()), asked["step"]
    references = [one.valueReference for one in about.modelVariables]
    own = begun(unit, folder, about, asked)
    two = about.fmiVersion == "2.0"
    own.doStep(0.0, step)
    state = own.getFMUState()
    size = ctypes.c_size_t()
    measure = own.fmi2SerializedFMUstateSize if two else own.fmi3SerializedFMUStateSize
    measure(own.component, state, ctypes.byref(size))
    found = []
    for _ in range(2):
        own.setFMUState(state)
        for k in range(1, 6):
            own.doStep(k * step, step)
        found.append(read(own, references))
    own.freeFMUState(state)
    own.terminate()
    own.freeInstance()
    return found[0] == found[1], size.value


def main():
    unit, request, answer = sys.argv[1:]
    with open(request) as file:
        asked = json.load(file)
    same, size = same_bits(unit, asked)
    found = {
        "problems": [str(one) for one in validate_fmu(unit)],
        "columns": columns(unit, asked),
        "same": same,
        "state": size,
        "python": [name for name in ("mbody", "numba") if name in sys.modules],
    }
    with open(answer, "w") as file:
        json.dump(found, file)


if __name__ == "__main__":
    main()
