"""Every error sentence, made to happen: scenarios by subject, and docs/errors.md, made of them.

A scenario is a function that ends in one error. ``make errors`` (``python -m tests.errors``) runs
all of them and writes the page.
"""
