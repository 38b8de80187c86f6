"""The drawing board: a model file as a document that is drawn, dragged and computed."""
