"""Analyses: one folder a question; each takes a Mechanism or a System and gives a result."""
