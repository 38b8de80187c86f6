"""Known mechanisms, each described in one file as its book gives it."""
