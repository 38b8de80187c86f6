"""Exact derivatives of measured quantities by the numbers of a mechanism."""
