"""Where the repository is: tests compute no paths from their own."""

from pathlib import Path

ROOT = Path(__file__).parents[2]
