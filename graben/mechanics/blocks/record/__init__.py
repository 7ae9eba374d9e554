"""What a run leaves: saved states, the balance of forces at each, snapshots to go on from."""
