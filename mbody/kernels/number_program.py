"""Programs that turn numbers into others: a mechanism's numbers into those of the kernels, and what
is kept of an instant into measured quantities. They replace Python in the image of a model
(`mbody.image`).

A program has slots: first its inputs, then constants, then what its operations give, one after the
other. The operations are those of formulas (`mbody.laws.kernels`).
"""

from __future__ import annotations

from mbody.core.bundle import Bundle, Floats, Ints, Rows, Stacks, Tables
from mbody.core.decorators import kernel, njit
from mbody.core.lanes import dual, ld, st
from mbody.core.tolerances import FINITE
from mbody.kernels.layout import Layout, Work
from mbody.laws.kernels import LOG, binary, unary


class NumberProgram(Bundle):
    """Operations on slots.

    `slots` (slots,): Inputs, constants, results.
    `lowest`, `strict` (inputs,): What an input must not fall below, and where it must not reach it
      (1) or may (0).
    `operations` (operations, 4): Code, slots of the operands, slot of the result; of one operand
      both are the same.
    `targets` (outputs,): The slots of the results that are wanted.
    """

    slots: Floats
    lowest: Floats
    strict: Ints
    operations: Tables
    targets: Ints


@njit
def run(P):
    """Evaluate all operations in their order."""
    slots, operations = P.slots, P.operations
    for n in range(operations.shape[0]):
        code, a, b = operations[n, 0], slots[operations[n, 1]], slots[operations[n, 2]]
        if code <= LOG:
            value, _, _ = unary(code, a, 0.0, 0.0)
        else:
            value, _, _ = binary(code, a, 0.0, 0.0, b, 0.0, 0.0)
        slots[operations[n, 3]] = value


@kernel
def number_duals(P: NumberProgram, slots: Rows, found: Rows) -> None:
    """The targets of P with derivatives, found (outputs, lanes) as dual numbers, from those of its
    inputs in the first rows of slots (slots, lanes).
    """
    w = dual()
    operations = P.operations
    for n in range(P.lowest.shape[0], P.slots.shape[0]):
        st(slots, n, P.slots[n], w)
    for n in range(operations.shape[0]):
        code = operations[n, 0]
        a, b = ld(slots, operations[n, 1], w), ld(slots, operations[n, 2], w)
        if code <= LOG:
            number, _, _ = unary(code, a, 0.0, 0.0)
        else:
            number, _, _ = binary(code, a, 0.0, 0.0, b, 0.0, 0.0)
        st(slots, operations[n, 3], number, w)
    for n in range(found.shape[0]):
        st(found, n, ld(slots, P.targets[n], w), w)


@kernel
def set_numbers(P: NumberProgram, L: Layout, W: Work) -> int:
    """W.par and W.mass from the inputs of P, whose targets are their rows, one after the other; −1
    of what stays.

    Returns −1, or the first input that is not finite or too low; then nothing is changed. Inputs
    that are right by themselves, but not together, give the number of inputs, and nothing is
    changed either.
    """
    inputs, rows = P.lowest.shape[0], W.par.shape[0]
    for n in range(inputs):
        value, low = P.slots[n], P.lowest[n]
        if not (value >= low and value < FINITE) or (P.strict[n] == 1 and value == low):
            return n
    run(P)
    for n in range(P.targets.shape[0]):
        if P.targets[n] >= 0 and not abs(P.slots[P.targets[n]]) < FINITE:
            return inputs
    for n in range(rows):
        if P.targets[n] >= 0:
            W.par[n, 0] = P.slots[P.targets[n]]
    for n in range(W.mass.shape[0]):
        W.mass[n, 0] = P.slots[P.targets[rows + n]]
    return -1


@kernel
def measures(P: NumberProgram, N: NumberProgram, t: Floats, records: Stacks, found: Rows) -> None:
    """Measured quantities of instants, found (instants, outputs), from what is kept of each,
    records (instants, rows, 1).

    The inputs of P are the rows of a record, the time, and the inputs of N.
    """
    rows, inputs = records.shape[1], N.lowest.shape[0]
    for n in range(inputs):
        P.slots[rows + 1 + n] = N.slots[n]
    for k in range(found.shape[0]):
        for n in range(rows):
            P.slots[n] = records[k, n, 0]
        P.slots[rows] = t[k]
        run(P)
        for n in range(found.shape[1]):
            found[k, n] = P.slots[P.targets[n]]
