"""Stepping: a motion that another program leads on, step by step."""
