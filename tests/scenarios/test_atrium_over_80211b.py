"""The atrium of the multi-view trackers with the network that its authors had: 802.11b cards."""

import pytest

from wsnsim import run


def test_the_atriums_messages_arrive_over_802_11b(scenarios, tmp_path):
    overrides = ("network.standard=ieee80211b", "duration_s=1.5", "record.images=[]")
    done = run(scenarios / "published" / "multiview_fgh.yaml", out=tmp_path / "run", overrides=overrides)
    summary = done.summary
    assert summary["delivery_ratio"] == 1.0
    assert summary["channel_bps"] == 11e6
    assert summary["position_error_mean_m"] < 0.15
    # cards of 0.74 W and more, all of the time
    assert done.nodes["energy_radio_listen_j"].sum() > 0.65 * 7 * 1.5
    assert summary["simulated_s"] == pytest.approx(1.5, abs=1.0)
