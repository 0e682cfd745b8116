"""3-D multi-view histogram trackers (Kushwaha & Koutsoukos, J. Sens. Actuator Netw. 2(2), 2013).

Reading order: `params`, `viewpoints`, `reference_model`, `proposal`,
`similarity`, `filtering`, then the tracker itself in `t0`.
"""
