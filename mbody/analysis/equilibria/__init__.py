"""Equilibria: their search, stability, and curves of them."""
