"""The smoothed history: each step once, N steps late, and nearer to the truth than the filter was."""

import numpy as np
import pytest

import wsnsim
from wsnsim.estimation.kalman import Gaussian, constant_velocity
from wsnsim.estimation.smoothing import smoothed
from wsnsim.rng import RandomStreams
from wsnsim.systems.multiview.history import History

DT, ACCELERATION_SD = 0.25, 2.0


def beliefs(count: int) -> list[Gaussian]:
    generator = RandomStreams(0).stream("beliefs")
    cov = np.diag([0.1**2] * 3 + [0.3**2] * 3)
    return [Gaussian(generator.standard_normal(6), cov * (1 + 0.1 * step)) for step in range(count)]


@pytest.mark.parametrize("lag", [1, 3, 20])
def test_each_step_comes_out_once_and_so_many_steps_late(lag: int) -> None:
    history, given, seen = History(lag), beliefs(12), []
    for step, belief in enumerate(given, start=1):
        ripe, history = history.followed_by(step, belief).ripe(DT, ACCELERATION_SD)
        assert [at for at, _ in ripe] == ([step - lag] if step > lag else [])
        seen += [at for at, _ in ripe]
    rest = history.rest(DT, ACCELERATION_SD)
    assert [at for at, _ in rest] == list(range(len(seen) + 1, 13))
    assert len(rest) == min(lag, 12)


def test_several_steps_at_once_ripen_together() -> None:
    """A base station that waited adds the measured step and those that passed."""
    history = History(2)
    for step, belief in enumerate(beliefs(6), start=1):
        history = history.followed_by(step, belief)
    ripe, left = history.ripe(DT, ACCELERATION_SD)
    assert [at for at, _ in ripe] == [1, 2, 3, 4]
    assert [at for at, _ in left.beliefs] == [5, 6]


def test_a_ripe_belief_is_smoothed_over_all_that_is_kept() -> None:
    given = beliefs(5)
    history = History(4)
    for step, belief in enumerate(given, start=1):
        history = history.followed_by(step, belief)
    (first,), _ = history.ripe(DT, ACCELERATION_SD)
    expected = smoothed(given, *constant_velocity(DT, ACCELERATION_SD))
    np.testing.assert_array_equal(first[1].mean, expected[0].mean)
    for (_, one), other in zip(history.rest(DT, ACCELERATION_SD), expected, strict=True):
        np.testing.assert_array_equal(one.mean, other.mean)
        np.testing.assert_array_equal(one.cov, other.cov)


def test_no_lag_keeps_and_says_nothing() -> None:
    history = History(0)
    for step, belief in enumerate(beliefs(5), start=1):
        ripe, history = history.followed_by(step, belief).ripe(DT, ACCELERATION_SD)
        assert ripe == ()
    assert history.beliefs == ()
    assert history.rest(DT, ACCELERATION_SD) == ()


def test_adding_a_step_leaves_the_history_before_it_alone() -> None:
    history = History(3)
    longer = history.followed_by(1, beliefs(1)[0])
    assert history.beliefs == ()
    assert len(longer.beliefs) == 1


@pytest.fixture(scope="module")
def runs(scenarios) -> list[wsnsim.Run]:  # type: ignore[no-untyped-def]
    short = ("duration_s=2.5", "expect={}", "system.particles=250", "system.smoothing_scans=4")
    path = scenarios / "published" / "multiview_setup_a.yaml"
    return [wsnsim.run(path, seed=seed, overrides=short) for seed in range(4)]


def test_a_run_smooths_every_step_once_and_so_many_steps_later(runs: list[wsnsim.Run]) -> None:
    for run in runs:
        smoothed_rows = run.tables["estimates"].query("kind == 'smoothed'")
        np.testing.assert_allclose(np.sort(smoothed_rows["time_s"]), np.arange(1, 11) / 4)
        late = (smoothed_rows["made_at_s"] - smoothed_rows["time_s"]).to_numpy()
        early = smoothed_rows["time_s"].to_numpy() <= 1.5
        assert (late[early] >= 1.0).all()
        assert (late[early] < 1.25).all()
        assert run.steps["smoothed_error_m"].notna().all()


def test_smoothing_brings_the_path_nearer_to_the_truth(runs: list[wsnsim.Run]) -> None:
    """Paired over runs: the filtered position error is larger, t > 2.353 (3 degrees of freedom, 5 %)."""
    gained = np.array([(run.steps["error_m"] - run.steps["smoothed_error_m"]).mean() for run in runs])
    assert gained.mean() / (gained.std(ddof=1) / np.sqrt(len(gained))) > 2.353


def test_without_smoothing_a_run_says_nothing_of_it(scenarios) -> None:  # type: ignore[no-untyped-def]
    run = wsnsim.run(
        scenarios / "published" / "multiview_setup_a.yaml",
        overrides=("duration_s=1", "expect={}", "system.particles=50", "system.smoothing_scans=0"),
    )
    assert set(run.tables["estimates"]["kind"]) == {"update"}
    assert run.steps["smoothed_error_m"].isna().all()
