"""Images: the memory of an assembled mechanism as bytes, on which the compiled core runs in a
browser, in C programs and in co-simulation units, without Python.
"""
