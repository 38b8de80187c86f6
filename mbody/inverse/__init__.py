"""The searches of `solve_for`: unknowns that meet conditions, or make a quantity greatest."""
