"""Where the blocks are: tessellations, given maps, straight joints, mending, bodies with grid points and zones."""
