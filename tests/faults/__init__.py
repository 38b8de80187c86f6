"""Planted faults: mutations of the physics in a copy of the package, which engines must see.

Each is one line of mbody changed in a copy, a mechanism on which it shows, and the engines of
`crosscheck` that differ then; at least two of them share no code with what was changed.
``python -m tests.faults`` prints the table.
"""
