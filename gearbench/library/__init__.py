"""Published gear pairs, one source a file."""
