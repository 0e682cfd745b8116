"""3-D multi-view histogram trackers (Kushwaha & Koutsoukos, J. Sens. Actuator Netw. 2(2), 2013).

Reading order: `params`, `viewpoints`, `reference_model`, `proposal`, `sight`,
`similarity` and `log_ratio`, `judgement`, `orientation`, `filtering`, then the tracker
itself: `t0_camera`, `following`, `t0_base`; `search` finds a target that no track follows.
"""
