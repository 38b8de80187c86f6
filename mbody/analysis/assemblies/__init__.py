"""In how many ways a mechanism closes, which of them motion joins, and where the driver stops."""
