"""Results on paper and in files: the readable sheet, tables, exports."""
