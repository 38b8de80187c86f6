"""Mobility: how many ways a mechanism can move, and which."""
