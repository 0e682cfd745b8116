"""Where in the file, or on the command line, a fault of a scenario is."""

import re
from collections.abc import Mapping
from dataclasses import dataclass

from wsnsim.errors import Problem
from wsnsim.scenario.faults import Fault, KeyPath, path_text
from wsnsim.scenario.yaml_marks import Document


@dataclass(frozen=True)
class Marks:
    """Where each value came from: a place in the file, or an argument of the command line."""

    document: Document
    arguments: Mapping[KeyPath, str]

    def found(self, problem: Problem) -> Problem:
        """Give a problem its place that is named by its path alone."""
        if problem.file is not None or problem.argument is not None:
            return problem
        steps = re.findall(r"[^.\[\]]+", problem.path)
        path = tuple(int(step) if step.isdecimal() else step for step in steps)
        return self.problem(Fault(path, problem.message))

    def problem(self, fault: Fault) -> Problem:
        """Give a fault its place; that of what encloses it where the value itself is missing."""
        text, file = path_text(fault.path), self.document.file
        prefixes = [fault.path[:length] for length in range(len(fault.path), -1, -1)]
        for prefix in prefixes:
            if prefix in self.arguments:
                return Problem(text, fault.message, argument=self.arguments[prefix])
        keys, values = self.document.keys, self.document.values
        if not fault.of_key and fault.path in values:
            return Problem(text, fault.message, file, *values[fault.path])
        for prefix in prefixes:
            place = keys.get(prefix) or values.get(prefix)
            if place is not None:
                return Problem(text, fault.message, file, *place)
        return Problem(text, fault.message, file)
