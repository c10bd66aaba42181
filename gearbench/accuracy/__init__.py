"""Accuracy control: chooses the settings for which a result has the requested accuracy."""
