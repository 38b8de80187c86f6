"""Runs of the gallery's models, as many tests need them."""

import functools

import mbody
from mbody import gallery
from mbody.model.numbers import number_in


def asked(machine, analysis=mbody.kinetostatics):
    """The analysis at the instants that the model requests."""
    ask = machine.ask
    if ask is None:  # free motion, of which a hundredth is enough here
        until = number_in(machine, machine.simulation.until, "time", "simulate", "until")
        return mbody.simulate(machine, until / 100.0, instants=5)
    if ask.over:
        return analysis(machine, turn=ask.over == "turn" or ask.over, instants=ask.instants)
    return analysis(machine, t=[number_in(machine, t, "time", "ask", "t") for t in ask.at["t"]])


@functools.cache
def run(name):
    return asked(gallery.load(name))
