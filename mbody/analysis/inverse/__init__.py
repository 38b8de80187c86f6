"""Questions: conditions between measured quantities, and answers."""
