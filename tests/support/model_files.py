"""The schema of model files, sentences of readers, and runs in two systems of units."""

import jsonschema

from mbody import ModelError
from mbody.files.model import json_schema

SCHEMA = jsonschema.Draft202012Validator(json_schema())


class says_in_file:
    """The block ends in a ModelError that holds one of the words."""

    def __init__(self, *words):
        self.words = words

    def __enter__(self):
        return self

    def __exit__(self, kind, error, _):
        assert kind is ModelError, error
        assert any(word in str(error) for word in self.words), error
        return True
