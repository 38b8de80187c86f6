"""Work of fixed workloads, counted and not timed: the same on a busy machine as on a quiet one.

`workloads` says what is counted, `plain` counts calls within kernels in plain Python, `table` keeps
the counts in `table.toml`. `python -m tests.work_counts` counts anew and writes the table.
"""
