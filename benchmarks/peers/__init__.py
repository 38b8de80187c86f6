"""The peers, each built from the same plain numbers and set up as its own manual advises."""
