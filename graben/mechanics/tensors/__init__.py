"""Principal values and directions of symmetric tensors."""
