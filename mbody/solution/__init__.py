"""Results by name: histories, measures, residuals, energy, momentum, doubts, restart."""
