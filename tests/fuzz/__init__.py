"""Fuzzing of the door: formulas, model files, saved results, sweep folders.

`python -m tests.fuzz --help`.
"""

#: Kinds of inputs, and their share in a run: formulas, tables that were changed and written, and
#: texts that were changed.
KINDS = {"formula": 70, "tables": 15, "toml": 10, "json": 5}
#: The same of what is kept in files: bytes of saved results that were changed, parts of them that
#: were changed and sealed anew, folders of sweeps.
KEPT = {"saved": 45, "resealed": 30, "folder": 25}
