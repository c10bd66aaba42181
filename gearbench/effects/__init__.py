"""The effects of a scene: each of them adds compliance or adds gap, one file per effect."""
