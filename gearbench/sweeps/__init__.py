"""A scene over ranges of its keys: loads above all."""
