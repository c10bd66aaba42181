"""The design bench: one gear pair with everything a scene may ask for as controls."""
