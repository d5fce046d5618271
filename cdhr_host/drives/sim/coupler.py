"""A simulated input/output coupler: analogue pressure and forces, the e-stop echo; CiA 401."""

from typing import Final

from cdhr_host.drives.sim.node import Nmt, Node

RAW: Final = 32767
OUTPUTS: Final = (0x6411, 1)


class Coupler(Node):
    """Output 1 is the pressure set, input 1 the pressure measured, inputs 2-4 cable forces."""

    def __init__(self, node_id: int) -> None:
        super().__init__("coupler.eds", node_id)
        self.values[0x6000, 1] = 3
        self.overridden_inputs: dict[int, int] = {}

    def reset(self, now: float, *, communication: bool = False) -> None:
        """Boot: all outputs 0."""
        super().reset(now, communication=communication)
        self.values[0x6000, 1] = 3

    def synchronise(self) -> None:
        """Take what the last cycle's RPDO brought."""
        self.apply_sync()

    @property
    def output(self) -> int:
        """Raw value of the pressure output."""
        return self.values[OUTPUTS]

    def measured(self, raw: tuple[int, ...]) -> None:
        """Up to four raw inputs."""
        for k, value in enumerate(raw, start=1):
            held = max(-32768, min(RAW, value))
            self.values[0x6401, k] = self.overridden_inputs.get(k, held)

    def host_lost(self) -> None:
        """Outputs take their error values where 0x6443 says so."""
        self._fail_safe()
        super().host_lost()

    def enter(self, state: Nmt) -> None:
        """Leaving OPERATIONAL is a reason for error values too."""
        if self.state is Nmt.OPERATIONAL and state is not Nmt.OPERATIONAL:
            self._fail_safe()
        super().enter(state)

    def _fail_safe(self) -> None:
        for k in range(1, 5):
            if self.values[0x6443, k]:
                self.values[0x6411, k] = self.values[0x6444, k]
        if self.values[0x6206, 1]:
            self.values[0x6200, 1] = self.values[0x6207, 1]
