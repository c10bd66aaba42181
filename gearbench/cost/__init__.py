"""What accuracy costs: work–precision of every knob, measured on a scene."""
