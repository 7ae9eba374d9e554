"""The model that can be stepped, and its compiled loop on several threads."""
