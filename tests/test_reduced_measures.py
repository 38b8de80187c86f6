"""Measures that are one number of all instants, of models and sweeps: peak, rms, span, others."""

import json

import numpy as np
import pytest

import mbody
from mbody import Event, ModelError, cli, gallery
from mbody.files.model import from_toml, to_toml
from mbody.model.reductions import REDUCTIONS, outermost
from mbody.model.study import Measure

PLAIN = {
    "max": lambda a: max(a),
    "min": lambda a: min(a),
    "peak": lambda a: max(map(abs, a)),
    "span": lambda a: max(a) - min(a),
    "rms": lambda a: (sum(x * x for x in a) / len(a)) ** 0.5,
    "mean": lambda a: sum(a) / len(a),
    "first": lambda a: a[0],
    "last": lambda a: a[-1],
}


def machine(**measures):
    made = gallery.load("norton_fourbar")
    made.measures.clear()
    made.measures.update({name: Measure(*of) for name, of in measures.items()})
    return made


def test_every_reduction_is_that_of_the_history():
    assert set(PLAIN) == set(REDUCTIONS)
    own = machine(**{by: (f"{by}(motor.effort)", "N*m") for by in PLAIN})
    run = mbody.kinetostatics(own, turn="motor", instants=37)
    history = (run.effort("motor") * 4.4482216152605 * 0.0254).tolist()
    for by, plain in PLAIN.items():
        found = run.measure(by)
        assert found.shape == (37,) and np.ptp(found) == 0.0
        # a sum of 37 numbers
        assert found[0] == pytest.approx(plain(history), rel=1e-13, abs=1e-13)
    assert run.measure("at(motor.effort, 3)")[0] == run.effort("motor")[3]


@pytest.mark.parametrize("text", ["max(A.fx, A.fy)", "peak(A.fx)/2", "(peak(A.fx))", "abs(A.fx)"])
def test_only_what_is_around_the_whole_reduces(text):
    assert outermost(text) == ("", text, 0)


def test_a_table_of_measures_comes_back_from_its_file():
    own = machine(pin=("peak(A.force)", "N"), swing=("span(rocker.angle)",))
    again = from_toml(to_toml(own))
    assert again.measures == own.measures
    assert mbody.kinetostatics(again, turn="motor").measure("pin")[0] == pytest.approx(
        np.max(mbody.kinetostatics(own, turn="motor").reaction("A").magnitude) * 4.4482216152605
    )


def test_sheet_and_data_show_one_number(tmp_path, capsys):
    path = tmp_path / "own.toml"
    path.write_text(to_toml(machine(pin=("peak(A.force)",), torque=("motor.effort",))), "utf-8")
    how = [str(path), "--over", "motor", "--instants", "9"]
    assert cli.main(["kinetostatics", *how]) == 0
    rows = capsys.readouterr().out.partition("MEASURES")[2].splitlines()
    wanted = mbody.kinetostatics(gallery.load("norton_fourbar"), turn="motor", instants=9)
    (pin,) = (row.split() for row in rows if row.startswith("pin"))
    assert pin[2:] == ["lbf", "peak(A.force)"]
    assert float(pin[1]) == pytest.approx(wanted.reaction("A").magnitude.max(), rel=1e-5)
    assert cli.main(["kinetostatics", *how, "--json"]) == 0
    values = json.loads(capsys.readouterr().out)["measures"]["pin"]
    assert len(values) == 9 and set(values) == {float(wanted.reaction("A").magnitude.max())}


def test_sweeps_take_them_by_name():
    own = machine(pin=("peak(A.force)", "N"), swing=("span(rocker.angle)", "deg"))
    lengths = {"rocker.B.x": [9.5, 10.5]}
    by_name = mbody.sweep(own, lengths, over="motor", instants=37)
    by_text = mbody.sweep(
        own,
        lengths,
        measure={
            "pin": Measure("peak(A.force)", "N"),
            "swing": Measure("span(rocker.angle)", "deg"),
        },
        over="motor",
        instants=37,
    )
    for name in ("pin", "swing"):
        assert by_name[name].shape == (2,)
        assert np.array_equal(by_name[name], by_text[name])
    with pytest.raises(ModelError, match="'pin' is one number of all instants already"):
        mbody.sweep(own, lengths, measure="rms(pin)", over="motor")


def test_the_gradient_of_a_span_is_that_of_differences():
    own = gallery.load("norton_fourbar")
    found = mbody.gradient(own, "span(coupler.P.y)", ["crank.A.x", "rocker.B.x"], turn="motor")
    system = mbody.assemble(own)
    for k, name in enumerate(("crank.A.x", "rocker.B.x")):
        start, step = float(system.values[name]), 1e-5
        ends = [
            mbody.kinetostatics(system.with_values({name: start + s * step}), turn="motor").measure(
                "span(coupler.P.y)"
            )[0]
            for s in (1, -1)
        ]
        # central differences: error of the order step² and rounding 1e-14/step
        slope = (ends[0] - ends[1]) / (2 * step)
        assert np.ravel(found.jacobian)[k] == pytest.approx(slope, rel=1e-7)


def test_an_aim_and_a_limit_may_be_a_span():
    found = mbody.optimize(
        gallery.load("norton_fourbar"),
        minimize="peak(motor.effort)",
        by={"rocker.B.x": (9.0, 11.0)},
        subject_to=["span(rocker.angle) <= 1 rad"],
        over="motor",
        instants=73,
        starts=1,
    )
    length = found.values["rocker.B.x"]
    system = mbody.assemble(gallery.load("norton_fourbar")).with_values({"rocker.B.x": length})
    run = mbody.kinetostatics(system, turn="motor", instants=73)
    # the limits of the search hold to 1e-6
    assert np.ptp(run["rocker"].angle) <= 1 + 1e-6


def test_where_an_instant_is_meant_it_is_refused():
    own = machine(pin=("peak(A.force)",))
    run = mbody.kinetostatics(own)
    with pytest.raises(ModelError, match=r"one number of all instants.*O\.force"):
        mbody.Simulator(gallery.load("double_pendulum")).measure("peak(O.force)")
    pendulum = gallery.load("simple_pendulum")
    pendulum.measures["top"] = Measure("max(pendulum.angle)")
    with pytest.raises(ModelError, match=r"event 'stop': .*one number of all instants"):
        mbody.simulate(pendulum, 0.1, events=[Event("top", name="stop")])
    with pytest.raises(ModelError, match="there is no such instant, they are 0 to 0"):
        run.measure("at(A.force, 4)")
    with pytest.raises(ModelError, match="at takes a quantity and the number of an instant"):
        Measure("at(A.force)")
