"""Contacts that open, slide, stick and strike: complementarity problems and their laws."""
