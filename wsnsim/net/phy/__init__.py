"""The physical layer: what a frame takes on the air, who hears it, and what overlaps do to it."""
