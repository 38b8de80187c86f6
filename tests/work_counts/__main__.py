"""`python -m tests.work_counts` counts anew and writes the table; `--help` says so."""

import argparse

from tests import work_counts
from tests.work_counts.table import TABLE, counted, written

parser = argparse.ArgumentParser("python -m tests.work_counts", description=work_counts.__doc__)
parser.parse_args()
TABLE.write_text(written(counted()), encoding="utf-8")
print(f"wrote {TABLE.name}")
