"""Rest positions: their search, stability, and curves of them."""
