"""calibrate: `stage.py` is the way of its data, from curves to a law and what they cannot tell."""
