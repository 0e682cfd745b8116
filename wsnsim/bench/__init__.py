"""Speed as ratios: each kernel against a plain twin or a peer, in the same run on the same images."""
