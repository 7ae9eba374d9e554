"""homogenize: `stage.py` averages runs of blocks, `spheres.py` beds of grains."""
