"""Straight-line code: the continuation of one topology, written out without loops over index lists.

The kernels of `mbody.kernels` serve any mechanism by lists of indices. Where many designs of one
topology are followed, or one motion again and again, their lists can be run through once and for
all, on numbers that record what is done with them (`pieces`); what is recorded becomes machine code
with the lanes in registers (`instructions`; `whole_function`, of which `function_of_designs` and
`function_of_motion` are the two kinds; `code_builder`), a third of the time of the kernels. The
physics is that of the kernels, which are written once. `programs` finds, makes and runs it.
"""
