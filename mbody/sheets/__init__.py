"""Results on paper: the readable sheet of every analysis."""
