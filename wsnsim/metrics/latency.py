"""How soon after a sampling instant its estimate is there, and how often none is."""

import numpy as np
import pandas as pd

from wsnsim.metrics.accuracy import Figures


def latency(steps: pd.DataFrame) -> Figures:
    """Return percentiles of the estimates' latency, and the steps without any measurement.

    A deadline is missed where a target's estimate at a step is a mere
    prediction, or where there is none.

    Parameters
    ----------
    steps : the table of `steps_table`
    """
    waited = steps["latency_s"].dropna().to_numpy(np.float64)
    return {
        "latency_p50_s": float(np.percentile(waited, 50)) if waited.size else None,
        "latency_p95_s": float(np.percentile(waited, 95)) if waited.size else None,
        "missed_deadlines": int((steps["kind"] != "update").sum()),
    }
