"""Every error sentence, made to happen: scenarios by subject, each a function that ends in one error.

A subject has its `SCENARIOS` and, a line each in the same order, their `SENTENCES`:
``scenario | kind of the error | element | sentence``, where "-" is no element, "⏎" a new line and
"…" stands for anything, as for what rounding decides.
"""
