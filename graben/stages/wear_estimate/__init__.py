"""wear-estimate: `stage.py` is the way of its data, from grooves and counts to a rate."""
