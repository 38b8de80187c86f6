"""Compiled kernels: flat arrays and numbers only, no objects, no names.

Every kernel is written once and runs on float64 (one design) or on lanes (many designs or instants
at once), as its witness `w` says; see `mbody.core.lanes`.
"""
