"""Functions of formulas that are made of others, written out: programs need no operation of their
own for them.
"""

from __future__ import annotations

from dataclasses import replace

from mbody.quantities.tree import Binary, Call, Measured, Negative, Node

__all__ = ["expanded"]


def expanded(node: Node) -> Node:
    """The tree with every `clamp` and `deadband` written as sums, `min` and `max`.

    ``clamp(x, low, high)`` is x within low … high (a saturation), ``deadband(x, w)`` is 0 within
    −w … w and x ∓ w beyond it.

    >>> from mbody.quantities import parse, text_of
    >>> text_of(expanded(parse("clamp(x, -1, 2)"))), text_of(expanded(parse("deadband(x, 3)")))
    ('max(min(x, 2), -1)', 'x - max(min(x, 3), -3)')
    """
    match node:
        case Measured(of=below) | Negative(of=below):
            return replace(node, of=expanded(below))
        case Binary(a=a, b=b):
            return replace(node, a=expanded(a), b=expanded(b))
        case Call(function=function, arguments=arguments):
            given = tuple(expanded(argument) for argument in arguments)
            if function == "clamp":
                return _within(*given)
            if function == "deadband":
                x, width = given
                return Binary("-", x, _within(x, Negative(width), width))
            return Call(function, given)
    return node


def _within(x: Node, low: Node, high: Node) -> Node:
    return Call("max", (Call("min", (x, high)), low))
