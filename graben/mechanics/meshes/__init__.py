"""Plane meshes: mapped, paved, sized; each checked as one body."""
