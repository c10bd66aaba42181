"""Compliance of teeth and gear bodies by the Ritz method, and of flanks near edges and kinks; ``effects`` use it."""
