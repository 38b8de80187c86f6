"""The same mechanism in other engines, and what they say of our results."""
