"""Motions with events in complex numbers: the independent route beside gradients through events.

Own small equations of motion, by Runge's and Kutta's method of order 4 with many steps; where an
event is zero the step to it has a complex length, found by Newton's method, and so has the last
one, so that a parameter with an imaginary part of 1e-30 gives exact derivatives of all of it.
"""

import numpy as np

STEP = 1e-30


def step(rates, y, h):
    a = rates(y)
    b = rates(y + 0.5 * h * a)
    c = rates(y + 0.5 * h * b)
    return y + h / 6.0 * (a + 2.0 * b + 2.0 * c + rates(y + h * c))


def followed(modes, mode, y, until, count=4000):
    """The last state and the times of all events.

    modes: by name (rates of y, {next mode: (event of y, state after it)}); an event is one where
    its value falls below zero.
    """
    y, t, times, h0 = np.array(y, dtype=complex), 0.0 + 0.0j, [], until / count
    while t.real < until - 1e-14:
        rates, events = modes[mode]
        h = min(h0, until - t.real)
        last = h < h0 or t.real + h >= until - 1e-14
        ahead = step(rates, y, until - t if last else h)
        # what begins at zero is not over before it rose
        hit = [
            name for name, (event, _) in events.items() if event(ahead).real < 0.0 < event(y).real
        ]
        if not hit:
            y, t = ahead, complex(until) if last else t + h
            if last:
                break
            continue
        event, after = events[hit[0]]
        length = 0.5 * h + 0.0j
        for _ in range(60):
            there = step(rates, y, length)
            slope = (event(step(rates, y, length + 1e-7)) - event(there)) / 1e-7
            length = length - event(there) / slope
        # the slope of a difference slows the imaginary part down, it does not change its limit
        y, t, mode = after(step(rates, y, length)), t + length, hit[0]
        times.append(t)
    return y, times


def derivatives(run, numbers):
    """Of the last state and of the times, (…, numbers), by a complex step in each; run: of a list
    of numbers.
    """
    states, times = [], []
    for k in range(len(numbers)):
        moved = np.array(numbers, dtype=complex)
        moved[k] += 1j * STEP
        y, t = run(moved)
        states.append(np.imag(y) / STEP)
        times.append(np.imag(t) / STEP)
    return np.array(states).T, np.array(times).T
