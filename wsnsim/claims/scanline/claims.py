"""All claims of the page in their order: the paper's, then ours."""

from wsnsim.claims.scanline.ours import OURS
from wsnsim.claims.scanline.paper import PAPER

CLAIMS = (*PAPER, *OURS)
