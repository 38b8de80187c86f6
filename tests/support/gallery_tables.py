"""Which tables the files of the gallery have: parameters of tests need no model made of them."""

import functools
import tomllib

from mbody import gallery


@functools.cache
def tables(name):
    """Names of the tables in a model's file."""
    return frozenset(tomllib.loads(gallery.path(name).read_text("utf-8")))
