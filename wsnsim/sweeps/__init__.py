"""Studies: many runs of scenarios, over cells and seeds, in a pool of processes and into one file."""
