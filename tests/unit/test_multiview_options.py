"""The printed and the mended forms of the multi-view trackers, each by name."""

import numpy as np
import pytest
from pydantic import ValidationError

from wsnsim.hardware.work import Work
from wsnsim.systems.multiview.estimators import position_estimate
from wsnsim.systems.multiview.params import (
    PUBLISHED,
    CloudParticipation,
    FixedNoise,
    MultiviewParams,
    PointParticipation,
    RawLikelihood,
    SharpenedLikelihood,
)
from wsnsim.systems.multiview.similarity import Similarity, particle_weights


def params(**values: object) -> MultiviewParams:
    return MultiviewParams.model_validate({"kind": "multiview", **values})


def test_the_published_preset_is_the_printed_form() -> None:
    published = params(preset="published")
    assert isinstance(published.likelihood, RawLikelihood)
    assert isinstance(published.participation, PointParticipation)
    assert isinstance(published.measurement_noise, FixedNoise)
    assert published.colour_space == "hs"
    assert set(PUBLISHED) <= set(MultiviewParams.model_fields)


def test_explicit_keys_override_a_preset() -> None:
    mixed = params(preset="published", likelihood={"kind": "bhattacharyya"}, colour_space="hsv")
    assert mixed.likelihood == SharpenedLikelihood()
    assert mixed.colour_space == "hsv"
    assert isinstance(mixed.participation, PointParticipation)


def test_a_preset_written_out_is_the_same_again() -> None:
    for preset in ("default", "published"):
        chosen = params(preset=preset)
        assert MultiviewParams.model_validate(chosen.model_dump(mode="json")) == chosen
    assert isinstance(params().participation, CloudParticipation)


@pytest.mark.parametrize(
    "wrong", [{"preset": "printed"}, {"likelihood": {"kind": "raw", "sharpness": 3}}, {"estimator": "mean"}]
)
def test_options_that_do_not_exist_are_refused(wrong: dict[str, object]) -> None:
    with pytest.raises(ValidationError):
        params(**wrong)


def test_raw_weights_are_the_similarity() -> None:
    similarity = Similarity(np.array([0.9, 0.6, 0.0, 0.0]), np.array([True, True, False, True]), Work())
    weights = particle_weights(similarity, RawLikelihood())
    np.testing.assert_allclose(weights, [0.9, 0.6, 0.5, 0.0], atol=1e-8)
    assert weights.min() > 0.0


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
def test_estimators_against_sums_by_hand(kind, prior_sd: float, x: float) -> None:
    estimate = position_estimate(kind, PARTICLES, WEIGHTS, np.zeros(3), prior_sd**2 * np.eye(3))
    np.testing.assert_allclose(estimate, [x, 0.0, 0.0])
