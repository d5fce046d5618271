"""Blocks of a text's setpoints -> the same blocks with the air led, once it is known what follows them."""

from collections import deque
from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from cdhr_host.extrusion import AirStage
from cdhr_host.pipeline.checked import Checked
from cdhr_host.values import Array, Command, Pause, Setpoints


class Leading:
    """Commands stay in their place between the blocks; a pause is known to stand.

    A program that is refused is not led: its blocks pass as they are, and so they do without a stage.
    """

    def __init__(self, stage: AirStage[Setpoints] | None) -> None:
        self._stage = stage
        self._waiting: deque[Command | Checked] = deque()
        self._known = np.zeros(0)
        self._refused = False

    def push(self, step: Command | Checked) -> Iterator[Command | Checked]:
        """A further step -> those that are known now."""
        if self._stage is None or self._stage.lead == 0:
            yield step
            return
        self._waiting.append(step)
        if isinstance(step, Checked):
            self._take(self._stage, step)
        elif isinstance(step, Pause):
            self._flush(self._stage)
        yield from self._ready()

    def finish(self) -> Iterator[Command | Checked]:
        """All that is left, at the text's end."""
        if self._stage is not None:
            self._flush(self._stage)
        yield from self._ready()

    def _take(self, stage: AirStage[Setpoints], block: Checked) -> None:
        self._refused = self._refused or bool(block.problems)
        if not self._refused:
            self._add(stage.push(block.setpoints).pressure)

    def _flush(self, stage: AirStage[Setpoints]) -> None:
        if not self._refused and (rows := stage.flush()) is not None:
            self._add(rows.pressure)

    def _add(self, pressure: Array) -> None:
        self._known = np.concatenate((self._known, pressure))

    def _ready(self) -> Iterator[Command | Checked]:
        while self._waiting:
            step = self._waiting[0]
            if isinstance(step, Checked) and not self._refused:
                count = len(step.setpoints)
                if count > len(self._known):
                    return
                step = replace(step, setpoints=replace(step.setpoints, pressure=self._known[:count]))
                self._known = self._known[count:]
            self._waiting.popleft()
            yield step
