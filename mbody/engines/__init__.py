"""Cross-checks: the mechanism in other engines, and their results beside ours."""
