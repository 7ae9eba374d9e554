"""A plane body: quads, assembly, Newton, the march of loads, and how near it is to collapse."""
