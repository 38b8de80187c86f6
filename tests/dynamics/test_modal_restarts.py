"""Motions with contacts and frictional joints go on bit for bit, from memory and from files."""

import numpy as np
import pytest

import mbody
from tests.contact.test_modes_together import free_slider_crank
from tests.dynamics.test_stick_slip import pendulum
from tests.support import contact_models as models
from tests.support.cases import first_fast


def motion(name):
    """A model and how long it moves."""
    text = {"ball": models.BALL, "disc": models.DISC, "oscillator": models.OSCILLATOR}
    if name in text:
        return mbody.from_toml(text[name])
    if name == "woodpecker":
        return mbody.from_toml(models.WOODPECKER)
    return pendulum() if name == "pendulum" else free_slider_crank(0.1)


CASES = [
    ("ball", 3.0, (0.2, 1.0, 2.2)),
    ("disc", 0.9, (0.3, 0.6)),
    ("oscillator", 3.2, (0.6, 1.5, 3.1)),
    ("pendulum", 6.4, (1.0, 5.8)),
    ("slider-crank", 0.9, (0.3, 0.8)),
    ("woodpecker", 0.05, (0.01, 0.018, 0.03)),
]


@first_fast(("name", "until", "cuts"), CASES, 4)
def test_a_motion_goes_on_bit_for_bit(name, until, cuts, tmp_path):
    machine = motion(name)
    how = {"rtol": 1e-10}
    whole = mbody.simulate(machine, until, times=np.linspace(0.0, until, 60), **how)
    for cut in cuts:
        first = mbody.simulate(machine, cut, instants=5, **how)
        mbody.save_run(first, tmp_path / "run.npz")
        later = np.append(cut, whole.t[whole.t > cut])
        for start in (first, mbody.load_run(tmp_path / "run.npz")):
            run = mbody.simulate(machine, until, start=start, times=later, **how)
            pages, known = (one.record.table(slice(None)) for one in (run, whole))
            np.testing.assert_array_equal(pages[1:], known[whole.t > cut])
            ours = [(one.name, one.contact, one.t) for one in run.events]
            theirs = [(e.name, e.contact, e.t) for e in whole.events if e.t > cut]
            assert ours == theirs
            for contact, modes in run.modes.items():
                assert modes[1:] == [
                    mode for mode, t in zip(whole.modes[contact], whole.t, strict=True) if t > cut
                ]
            taken = {part: row[-1] - row[0] for part, row in run.energy.lost.items()}
            at = int(np.searchsorted(whole.t, cut))
            for part, row in whole.energy.lost.items():
                whole_part = first.energy.lost[part][-1] + taken[part]
                assert whole_part == pytest.approx(row[-1], abs=1e-10 * whole.energy.size), at
