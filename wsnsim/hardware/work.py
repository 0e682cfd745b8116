"""Work: what a program's step costs, in operations; a platform prices it."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Work:
    """Operations of one step, independent of the processor that does them."""

    int_ops: float = 0.0
    float_ops: float = 0.0
    memory_bytes: float = 0.0

    def __add__(self, other: "Work") -> "Work":
        return Work(
            self.int_ops + other.int_ops,
            self.float_ops + other.float_ops,
            self.memory_bytes + other.memory_bytes,
        )
