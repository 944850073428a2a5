"""From a model file to a prepared scene."""
