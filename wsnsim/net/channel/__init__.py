"""What lies between two antennas: path loss, links that come of it, and what changes while a run lasts."""
