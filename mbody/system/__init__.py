"""From a description to flat arrays: assembler, elimination order, pivots, Assur groups, rank."""
