"""Singular positions: the branches of motion that meet there."""
