from tests.work_counts.table import TABLE, counted, written

TABLE.write_text(written(counted()), encoding="utf-8")
print(f"wrote {TABLE.name}")
