"""Pictures of results: mechanisms drawn as in textbooks, quantities plotted over the cycle."""

from mbody.views.drawing import draw
from mbody.views.film import animate
from mbody.views.labels import save
from mbody.views.page import view
from mbody.views.plotting import plot

__all__ = ["animate", "draw", "plot", "save", "view"]
