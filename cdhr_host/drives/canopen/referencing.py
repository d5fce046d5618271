"""Whether the axes know the reference pose: by themselves, by a stored offset, or by homing."""

from collections.abc import Callable

import numpy as np

from cdhr_host.drives.canopen.homing import home, mark, marks
from cdhr_host.drives.canopen.machine import CanopenMachine
from cdhr_host.drives.link import Told
from cdhr_host.drives.reference import ReferenceStore, unreferenced
from cdhr_host.profile.schema import Profile
from cdhr_host.values import Ints


class Referencing:
    """What ``[canopen] reference`` asks for; ``zero`` (6,) is what the drives read at the reference pose."""

    def __init__(self, profile: Profile, store: ReferenceStore) -> None:
        self.zero: Ints = np.zeros(6, dtype=np.int64)
        self._profile = profile
        self._mode = profile.canopen.reference
        self._store = store
        self._homed = False

    def adopt(self, machine: CanopenMachine) -> None:
        """What is known from earlier sessions; raises DriveError."""
        serials = machine.found.serials
        self.zero = np.zeros(6, dtype=np.int64)
        if self._mode == "stored" and self._store.known(self._profile, serials):
            self.zero = self._store.zero(self._profile, serials)
        elif self._mode == "homing":
            self._homed = self._store.marked(self._profile, serials, marks(machine))

    def check(self, machine: CanopenMachine) -> None:
        """DriveError with the next step unless every axis knows the reference pose."""
        if lost := sorted(axis + 1 for axis in machine.watch.unreferenced):
            raise unreferenced(lost, self._mode)
        if self._mode == "stored":
            self._store.zero(self._profile, machine.found.serials)
        elif self._mode == "homing" and not self._homed:
            raise unreferenced([1, 2, 3, 4, 5, 6], self._mode)

    def home(self, machine: CanopenMachine, should_stop: Callable[[], bool], told: Told) -> None:
        """Mode 6, one slider at a time; nothing to do where the profile says otherwise.

        It holds as long as the drives have power: they keep a mark, and so does the store.
        """
        if self._mode == "homing":
            self._homed = False
            home(machine, should_stop, told)
            self._store.mark(self._profile, machine.found.serials, mark(machine))
            self._homed = True
            machine.watch.unreferenced.clear()

    def set(self, machine: CanopenMachine) -> None:
        """The machine stands at its reference pose."""
        self._store.save(self._profile, machine.found.serials, machine.position)
        machine.watch.unreferenced.clear()
        self.adopt(machine)

    def forget_lost(self, machine: CanopenMachine) -> None:
        """A stored reference of an axis that cannot be trusted any more is stored no longer."""
        lost = machine.watch.unreferenced
        if lost and self._mode != "drive":
            self._store.forget(self._profile, [machine.found.serials[axis] for axis in lost])
