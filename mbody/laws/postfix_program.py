"""From the tree of a formula to operations in postfix order (`mbody.laws.postfix`)."""

from __future__ import annotations

from fractions import Fraction

from mbody.quantities.tree import Binary, Call, Measured, Name, Negative, Node, Plain

__all__ = ["PostfixProgram"]

ONE = Plain(Fraction(1))


class PostfixProgram:
    """Operations in postfix order, the variables in the order in which they are taken, and the
    constants: the parts without a variable.
    """

    def __init__(self, variables: frozenset[str]) -> None:
        self.variables = variables
        self.operations: list[str] = []
        self.taken: list[str] = []
        self.constants: list[Node] = []

    def free(self, node: Node) -> bool:
        """Whether a node has none of the variables."""
        return not node.names & self.variables

    def put(self, operation: str, constant: Node | None = None) -> None:
        """Append an operation, with the constant that it takes."""
        self.operations.append(operation)
        if constant is not None:
            self.constants.append(constant)

    def add(self, node: Node) -> None:
        """Append the operations that put the value of a node on the stack."""
        if self.free(node):
            self.put("constant", node)
        else:
            self.varying(node)

    def varying(self, node: Node) -> None:
        """Append those of a node that has a variable."""
        match node:
            case Name(name=name):
                self.taken.append(name)
                self.put("variable")
            case Negative(of=below):
                self.add(below)
                self.put("negative")
            case Measured(of=below, unit=unit, symbols=symbols):
                self.add(below)
                self.put("* constant", Measured(ONE, unit, symbols))
            case Call(function=function, arguments=arguments):
                for argument in arguments:
                    self.add(argument)
                self.put(function)
            case Binary(operator=operator, a=a, b=b):
                self.binary(operator, a, b)

    def binary(self, operator: str, a: Node, b: Node) -> None:
        """Append those of an operation on two nodes, one of which has a variable."""
        if operator == "-" and self.free(b):
            operator, b = "+", Negative(b)
        elif operator == "-" and self.free(a):
            operator, a, b = "+", Negative(b), a
        elif operator in "+*" and self.free(a):
            a, b = b, a
        self.add(a)
        if self.free(b):
            self.put(f"{operator} constant", b)
        else:
            self.add(b)
            self.put(operator)
