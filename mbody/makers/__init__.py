"""Makers of common bodies and mechanisms: plain functions that describe what a user could write."""

from mbody.makers.makers import bar, four_bar, slider_crank

__all__ = ["bar", "four_bar", "slider_crank"]
