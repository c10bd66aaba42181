"""Scenes as text, to which tests add what they are about."""

#: A helical pair under a torque, nothing in it yields but the contact.
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
