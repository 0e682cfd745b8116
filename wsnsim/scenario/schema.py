"""A whole scenario as frozen values; what stands in YAML, in the order in which it is written out."""

from typing import Annotated, Any, TypeAlias

from pydantic import BeforeValidator, Field

from wsnsim.scenario.expectations import parse_comparison
from wsnsim.scenario.faults import shown
from wsnsim.scenario.schema_base import Name, Part, Seed, wrong
from wsnsim.scenario.schema_cameras import Camera
from wsnsim.scenario.schema_motes import Motes
from wsnsim.scenario.schema_network import NetworkParams
from wsnsim.scenario.schema_world import World


def _comparison_text(text: Any) -> Any:
    if not isinstance(text, str):
        raise wrong(f'must be a comparison such as "< 0.12", in quotes, got {shown(text)}')
    try:
        parse_comparison(text)
    except ValueError as error:
        raise wrong(f"{error}, got {shown(text)}") from None
    return text


ComparisonText: TypeAlias = Annotated[str, BeforeValidator(_comparison_text)]


MAX_NAME = 100
"""Characters of a scenario's name at most."""


_EVERY = 10
"""Steps from one recorded image to the next; 1, 10, 20 and 30 are those of Kushwaha & Koutsoukos's Fig. 8."""


class Record(Part):
    """What is recorded beyond the tables that every run has."""

    frames: bool = Field(False, description="one row for every radio frame and receiver")
    images: tuple[Name, ...] = Field(
        (), description="cameras whose images are kept, as the programs got them; about 150 kB each"
    )
    image_steps: tuple[Annotated[int, Field(ge=1)], ...] | None = Field(
        None, description="steps whose images are kept; null: the first and every tenth (1, 10, 20, ...)"
    )

    def keeps_image(self, camera: str, step: int) -> bool:
        """Return whether the image that a camera takes at a step is kept."""
        if camera not in self.images:
            return False
        if self.image_steps is None:
            return step == 1 or step % _EVERY == 0
        return step in self.image_steps


class Scenario(Part):
    """Everything a run depends on.

    `system` holds plain data: its keys belong to the tracking system, whose own
    parameters model has checked and completed them.
    """

    name: str = Field(
        pattern=r"^\w[\w.-]*$",
        max_length=MAX_NAME,
        description="name of the scenario; the file's own where it is left out",
    )
    seed: Seed = Field(0, description="seed of all randomness")
    duration_s: float = Field(gt=0, le=1e7, description="simulated time [s]")
    world: World | None = Field(
        None, description="ground truth; null: open space with nothing in it, for systems without cameras"
    )
    cameras: tuple[Camera, ...] = Field((), description="what sees; none for systems that need no cameras")
    motes: Motes = Field(description="what computes and sends")
    network: NetworkParams = Field(NetworkParams(), description="how messages travel")
    system: dict[str, Any] = Field(description="the tracking system: its kind and its own keys")
    record: Record = Field(Record(), description="what is recorded beyond the usual")
    expect: dict[str, ComparisonText] = Field(
        default_factory=dict, description='figures of the summary and what they must be, such as "< 0.12"'
    )

    @property
    def true_world(self) -> World:
        """The world of a scenario that has one."""
        assert self.world is not None
        return self.world

    @property
    def steps(self) -> int:
        """Number of the last tracking step, 0 without cameras; the last of whole periods counts."""
        if not self.cameras:
            return 0
        return int(self.duration_s * self.cameras[0].rate_hz * (1 + 1e-12))
