"""Benchmarks: mbody and its peers in turn in one process, at equal accuracy."""
