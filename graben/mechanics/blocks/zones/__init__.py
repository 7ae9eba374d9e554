"""How the rock of a block answers: elastic, yielding, or not at all."""
