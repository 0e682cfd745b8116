"""How soon after a sampling instant its estimate is there, and how often it comes without a measurement."""

import numpy as np
import pandas as pd

from wsnsim.metrics.figures import Figures


def latency(steps: pd.DataFrame) -> Figures:
    """Return percentiles of the estimates' latency, and counts of the (step, target) pairs without one.

    - `latency_p50_s`, `latency_p95_s`, `latency_p99_s`: of the estimates made from measurements;
      a prediction is there at once and says nothing of how long measuring takes. Beside them
      `latency_mean_s` and `latency_max_s` of the same.
    - `missed_deadlines`: cameras were asked and none was heard in time, or
      there is no estimate at all; those that were passed over are not among them.
    - `unmeasured_steps`: no measurement, for whatever reason.
    - `skipped_steps`: the tracker was still busy with an earlier step.

    Parameters
    ----------
    steps : the table of `steps_table`
    """
    kind = steps["kind"]
    waited = steps.loc[kind == "update", "latency_s"].to_numpy(np.float64)
    return {
        "latency_mean_s": float(waited.mean()) if waited.size else None,
        "latency_max_s": float(waited.max()) if waited.size else None,
        "latency_p50_s": float(np.percentile(waited, 50)) if waited.size else None,
        "latency_p95_s": float(np.percentile(waited, 95)) if waited.size else None,
        "latency_p99_s": float(np.percentile(waited, 99)) if waited.size else None,
        "missed_deadlines": int(((kind == "timed_out") | kind.isna()).sum()),
        "unmeasured_steps": int((kind != "update").sum()),
        "skipped_steps": int((kind == "skipped").sum()),
    }
