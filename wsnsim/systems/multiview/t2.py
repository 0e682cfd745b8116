"""T2: the mixtures of T1, fused at every relay on their way to the base station (Sec. 5.2).

A relay multiplies what its children and its own camera say and reduces the product to
as many components as one message holds (Kushwaha & Koutsoukos 2013, Eqs. 30 to 35;
`joining`). The base station does with what arrives as T1's does.
"""

from dataclasses import replace

from wsnsim.systems.multiview import t1

VARIANT = replace(t1.VARIANT, fused_on_the_way=True)
