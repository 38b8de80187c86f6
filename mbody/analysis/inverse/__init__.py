"""Inverse problems: unknown numbers of a description that meet conditions."""
