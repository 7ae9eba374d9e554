"""One file an element: shape functions, points, faces and what its integrals need. No mesh, no law."""
