"""3-D multi-view histogram trackers (Kushwaha & Koutsoukos, Sensors 13, 2013).

Reading order: `params`, `viewpoints`, `reference_model`, `proposal`,
`similarity`, `filtering`, then the tracker itself in `t0`.
"""
