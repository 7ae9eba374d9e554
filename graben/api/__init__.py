"""What ``import graben`` offers to Python: thin functions over stages and mechanics."""
