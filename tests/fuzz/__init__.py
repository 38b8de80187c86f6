"""Fuzzing of the door: formulas and model files. `python -m tests.fuzz --help`."""

#: Kinds of inputs, and their share in a run: formulas, tables that were changed and written, and
#: texts that were changed.
KINDS = {"formula": 70, "tables": 15, "toml": 10, "json": 5}
