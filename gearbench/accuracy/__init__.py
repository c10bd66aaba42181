"""Accuracy: settings chosen so that a result has the accuracy asked for."""
