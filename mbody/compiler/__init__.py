"""Compilation of kernels: decorators, linking, bundles, cache, lanes, callbacks to Python."""
