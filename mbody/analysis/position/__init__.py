"""Position analysis: closing the loops, initial guesses, what to say where they do not close."""
