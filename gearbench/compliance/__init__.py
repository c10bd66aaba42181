"""Compliance of teeth and gear bodies by the Ritz method."""
