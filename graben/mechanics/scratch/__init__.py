"""One grain scratches a specimen: bricks in space, contact, explicit steps, frames."""
