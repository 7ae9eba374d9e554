"""graben: from a scene of discrete rock or sand to numbers an engineer can use."""

__version__ = "0.1.0"
