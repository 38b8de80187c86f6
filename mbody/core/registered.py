"""Modules that the core uses without importing them; the front door of the package names them.

The folder of the compiler imports the core, and numba may be missing; a process that runs machine
code never loads it.
"""

#: The numba half of decorators, bundles and lanes.
compiler = ""
#: The program that builds kernels, for ``python -m``.
builder = ""
