"""A scenario: from YAML, with every fault at its line, to values that the simulator can trust."""
