"""What lies between two antennas: path loss, shadowing, and the links that come of them."""
