"""Makers of common bodies and mechanisms: plain functions that describe what a user could write."""

from mbody.makers.makers import bar, four_bar, slider_crank
from mbody.model.element import polar

__all__ = ["bar", "four_bar", "polar", "slider_crank"]
