"""Scenes as text, to which tests append their subject."""

#: A helical pair under a torque, in which only the contact is compliant.
HELICAL = """
[pair]
normal_module = 2.0
helix_angle = 20.0
face_width = 20.0
centre_distance = 70.0
[pair.pinion]
teeth = 25
[pair.wheel]
teeth = 40
[load]
torque = 100.0
[effects.hertz]
"""
