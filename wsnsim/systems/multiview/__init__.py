"""3-D multi-view histogram trackers (Kushwaha & Koutsoukos, J. Sens. Actuator Netw. 2(2), 2013).

Reading order: `rules` and `params`, `viewpoints`, `reference_model`, `proposal`, `sight`,
`similarity` and `log_ratio`, `judgement`, `orientation`, `filtering`; what all trackers
share: `camera`, `eye`, `variants`, `following`, `base`; then the trackers, each a short
file: `t0`; `t1` with `whitening` and `mixing`; `t2` with `joining` and `relay`; `t3` with
`image_proposal` and `lifting`; `t4` with `map_estimate`; `p`. `search` and `quests` find a
target that no track follows.
"""
