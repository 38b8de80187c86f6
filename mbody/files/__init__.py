"""Results and models in files: tables, saved results, model files."""
