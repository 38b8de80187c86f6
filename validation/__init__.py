"""Truth from outside: one folder a case, with its model, its numbers and their source.

``python -m validation`` prints every row; pytest takes every row as a test.
"""
