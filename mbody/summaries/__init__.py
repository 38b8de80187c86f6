"""Results on paper: the readable summary of every analysis."""
