"""Numbers of a mechanism at which a quantity is least, within limits on the whole cycle."""
