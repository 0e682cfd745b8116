"""One object among occluders by scan lines (Ercan, El Gamal & Guibas, IPSN 2007).

Cameras reduce a frame to a scan line and say where in it the object is, or that they do not see it; a
cluster head tracks the object with an auxiliary particle filter that reckons with what may hide it.

Reading order: `measurement` (Eqs. 1, 2), `regions` (walls and fields of view), `occlusion` (Eqs. 3 to 6),
`likelihood`, `motion` (Sec. 4.1), `filter` (Fig. 4); what may be known of the occluders: `priors`, `hull`;
what Sec. 4 finds wanting: `baselines`.
"""
