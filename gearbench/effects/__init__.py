"""What a scene may ask for: each effect adds compliance or adds gap, one file per effect."""
