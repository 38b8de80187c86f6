"""Pictures of results: a mechanism drawn as in a textbook, quantities plotted over the cycle."""

from mbody.views.backend import save
from mbody.views.drawing import draw
from mbody.views.plotting import plot

__all__ = ["draw", "plot", "save"]
