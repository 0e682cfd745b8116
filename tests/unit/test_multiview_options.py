"""The printed and the mended forms of the multi-view trackers, each by name."""

import numpy as np
import pytest
from pydantic import ValidationError

from wsnsim.systems.multiview.estimators import position_estimate
from wsnsim.systems.multiview.params import PUBLISHED, MultiviewParams
from wsnsim.systems.multiview.rules import (
    AverageOrientation,
    CloudParticipation,
    FixedNoise,
    FixedSpread,
    LogRatioLikelihood,
    PointParticipation,
    PredictedSpread,
    RawLikelihood,
    SharpenedLikelihood,
    TrackLoss,
    WahbaOrientation,
)


def params(**values: object) -> MultiviewParams:
    return MultiviewParams.model_validate({"kind": "multiview", **values})


def test_the_published_preset_is_the_printed_form() -> None:
    """Algorithm 1 as printed: similarity as weight, cameras by the point, quaternions averaged."""
    published = params(preset="published")
    assert isinstance(published.likelihood, RawLikelihood)
    assert isinstance(published.participation, PointParticipation)
    assert isinstance(published.measurement_noise, FixedNoise)
    assert isinstance(published.spread, FixedSpread)
    assert isinstance(published.orientation, AverageOrientation)
    assert published.colour_space == "hs"
    assert published.loss is None
    assert set(PUBLISHED) <= set(MultiviewParams.model_fields)


def test_the_default_preset_is_the_mended_form() -> None:
    mended = params()
    assert isinstance(mended.participation, CloudParticipation)
    assert isinstance(mended.spread, PredictedSpread)
    assert isinstance(mended.orientation, WahbaOrientation)
    assert isinstance(mended.loss, TrackLoss)
    assert all(getattr(mended, key) != getattr(params(preset="published"), key) for key in PUBLISHED)


def test_explicit_keys_override_a_preset() -> None:
    mixed = params(
        preset="published",
        likelihood={"kind": "bhattacharyya", "sharpness": 31.0},
        colour_space="hsv",
        loss={"after_s": 3.0},
        orientation={"kind": "wahba", "update": 0.25},
    )
    assert mixed.likelihood == SharpenedLikelihood(sharpness=31.0)
    assert mixed.colour_space == "hsv"
    assert mixed.loss == TrackLoss(after_s=3.0)
    assert mixed.orientation == WahbaOrientation(update=0.25)
    assert isinstance(mixed.participation, PointParticipation)


@pytest.mark.parametrize(
    "chosen",
    [
        {},
        {"preset": "published"},
        {"likelihood": {"kind": "log_ratio"}, "loss": None},
        {"preset": "published", "start": "automatic", "loss": {}},
        {"orientation": {"kind": "initial"}, "encoding": "float16", "estimator": "map"},
    ],
)
def test_parameters_written_out_are_the_same_again(chosen: dict[str, object]) -> None:
    said = params(**chosen)
    assert MultiviewParams.model_validate(said.model_dump(mode="json")) == said


@pytest.mark.parametrize(
    ("kind", "form"),
    [("raw", RawLikelihood), ("bhattacharyya", SharpenedLikelihood), ("log_ratio", LogRatioLikelihood)],
)
def test_a_likelihood_is_chosen_by_its_name(kind: str, form: type) -> None:
    assert params(likelihood={"kind": kind}).likelihood == form()


@pytest.mark.parametrize(
    "wrong",
    [
        {"preset": "printed"},
        {"variant": "T9"},
        {"likelihood": {"kind": "raw", "sharpness": 3}},
        {"likelihood": {"kind": "bhattacharyya", "clip": 1}},
        {"likelihood": {"kind": "bhattacharyya", "sharpness": 0}},
        {"likelihood": {"sharpness": 3}},
        {"likelihood": "raw"},
        {"estimator": "mean"},
        {"encoding": "int8"},
        {"encoding": "float128"},
        {"orientation": {"kind": "average", "rate_update": 0.1}},
        {"orientation": {"kind": "wahba", "update": 0.0}},
        {"orientation": {"kind": "wahba", "update": 1.1}},
        {"orientation": {"kind": "wahba", "outlier_deg": 181}},
        {"spread": {"kind": "fixed", "floor_sd_m": 0.1}},
        {"spread": {"kind": "predicted", "floor_sd_m": 0.0}},
        {"spread": {"kind": "predicted", "largest_sd_m": float("inf")}},
        {"participation": {"kind": "cloud", "share_min": 0.0}},
        {"participation": {"kind": "point", "share_min": 0.5}},
        {"measurement_noise": {"kind": "fixed", "sd_m": float("nan")}},
        {"loss": {"after_s": 0.0}},
        {"loss": {"cameras_min": 1}},
        {"loss": {"similarity_min": 1.5}},
        {"initial_error": {"position_sd_m": -1.0}},
        {"smoothing_scans": -1},
        {"smoothing_scans": 2.5},
        {"usable_px_min": -1.0},
        {"particles": 3},
        {"start": "somewhere"},
        {"start": "automatic", "loss": None},
        {"start": "automatic", "preset": "published"},
        {"start": "automatic", "loss": {"search": False}},
    ],
)
def test_options_that_do_not_exist_are_refused(wrong: dict[str, object]) -> None:
    with pytest.raises(ValidationError):
        params(**wrong)


def test_the_deadline_is_1_8_periods_where_none_is_given() -> None:
    assert params().deadline(4.0) == pytest.approx(0.45)
    assert params(deadline_s=0.3).deadline(4.0) == 0.3


def test_how_targets_are_found_is_known_though_nothing_is_ever_lost() -> None:
    assert params(loss=None).searching == TrackLoss()
    assert params(loss={"sighting_min": 0.6}).searching.sighting_min == 0.6


PARTICLES = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [3.0, 0.0, 0.0]])
WEIGHTS = np.array([0.2, 0.3, 0.5])


@pytest.mark.parametrize(
    ("kind", "prior_sd", "x"),
    [
        ("mmse", 1.0, 0.3 * 1 + 0.5 * 3),
        ("mle", 1.0, 3.0),
        # scores at sd 1: -1.61, -1.70, -5.19; at sd 2: -1.61, -1.33, -1.82; a wide prior is the MLE
        ("map", 1.0, 0.0),
        ("map", 2.0, 1.0),
        ("map", 100.0, 3.0),
    ],
)
def test_estimators_against_sums_by_hand(kind, prior_sd: float, x: float) -> None:  # type: ignore[no-untyped-def]
    estimate = position_estimate(kind, PARTICLES, WEIGHTS, np.zeros(3), prior_sd**2 * np.eye(3))
    np.testing.assert_allclose(estimate, [x, 0.0, 0.0])
