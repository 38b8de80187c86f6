"""The image of a model: its memory as bytes, on which the compiled core runs without Python."""
