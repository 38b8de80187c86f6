"""Live pages: a view that solves its model again, by the core for browsers."""

from mbody.live.live_view import live_view

__all__ = ["live_view"]
