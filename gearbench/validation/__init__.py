"""What a fast model is worth: a scene against the same scene on finite elements."""
