"""SDO, NMT and EMCY by the ``canopen`` library, without a thread: whoever waits, reads the bus."""

import difflib
import logging
import queue
import re
import struct
from collections import Counter
from collections.abc import Callable
from functools import cache
from importlib import resources
from typing import Any, Final

import canopen
from canopen.sdo.exceptions import SdoAbortedError, SdoCommunicationError

from cdhr_host.drives.canopen.port import Port
from cdhr_host.drives.clock import Clock
from cdhr_host.drives.slcan import Frame
from cdhr_host.errors import DriveError, Problem

logging.getLogger("canopen").setLevel(logging.CRITICAL)

SLICE: Final = 0.5e-3
"""s between two looks at the bus while waiting"""
SDO_TIMEOUT: Final = 0.3
TWIN: Final = 0.005
"""s in which a second node with the same id would have answered too"""
NODES: Final = (1, 2, 3, 4, 5, 6, 7)
COUPLER: Final = 7
HOST: Final = 127
SIGNED: Final = (2, 3, 4)
"""data types INTEGER8, 16 and 32, CiA 301"""
NUMBERS: Final = re.compile(r"(?:0x)?([0-9a-f]{4})(?::(?:0x)?([0-9a-f]{1,2}))?", re.IGNORECASE)
ATTEMPTS: Final = 3
"""times a bus is scanned on which nobody answers: adapters and nodes may be waking up"""
SCAN: Final = 0.4
"""s nodes may take to answer a scan, and once more after the last request"""


class Abort(Exception):  # noqa: N818 - an answer of a node
    """A node refused an SDO transfer."""

    def __init__(self, code: int, text: str) -> None:
        super().__init__(text)
        self.code = code


@cache
def dictionary(node: int) -> Any:
    """The object dictionary of a node, from its EDS file."""
    eds = "coupler.eds" if node == COUPLER else "drive.eds"
    with resources.as_file(resources.files("cdhr_host.drives").joinpath("eds", eds)) as path:
        return canopen.import_od(str(path), node)


def object_name(node: int, index: int, sub: int) -> str:
    """``0x6065:00 Following error window``."""
    variable = dictionary(node).get_variable(index, sub)
    return f"0x{index:04X}:{sub:02X}" + (f" {variable.name}" if variable is not None else "")


def node_name(node: int) -> str:
    """In the words of an operator."""
    return f"drive {node}" if node in NODES[:6] else "the coupler" if node == COUPLER else f"node {node}"


def number_of(raw: bytes, node: int, index: int, sub: int) -> int:
    """The bytes of an object as the number they are by the dictionary."""
    variable = dictionary(node).get_variable(index, sub)
    signed = variable is not None and variable.data_type in SIGNED
    return int.from_bytes(raw, "little", signed=signed)


def object_place(node: int, text: str) -> tuple[int, int]:
    """``0x1018:4``, ``6065`` or a name of the dictionary -> index and sub-index.

    Numbers are hexadecimal. Raises DriveError, with the nearest name for one that is not known.
    """
    if numbers := NUMBERS.fullmatch(text.strip()):
        return int(numbers[1], 16), int(numbers[2] or "0", 16)
    known = _names(node)
    if (place := known.get(" ".join(text.lower().split()))) is not None:
        return place
    near = difflib.get_close_matches(text.lower(), known, n=1, cutoff=0.4)
    hint = f"did you mean '{near[0]}'?" if near else "0x6065 or 0x1018:4, or a name in quotes"
    raise DriveError(Problem("object", f"'{text}' is no object of {node_name(node)}", hint=hint))


@cache
def _names(node: int) -> dict[str, tuple[int, int]]:
    """Index and sub-index by name, in small letters; an entry of a record as ``record: entry`` too."""
    found: dict[str, tuple[int, int]] = {}
    for index, entry in dictionary(node).items():
        if isinstance(entry, canopen.objectdictionary.ODVariable):
            found.setdefault(entry.name.lower(), (index, 0))
            continue
        for sub, part in entry.items():
            found.setdefault(f"{entry.name}: {part.name}".lower(), (index, sub))
            found.setdefault(part.name.lower(), (index, sub))
    return found


def check_number(node: int, index: int, sub: int, value: int) -> None:
    """DriveError for a number that the object cannot hold."""
    variable = dictionary(node).get_variable(index, sub)
    bits = len(variable) if variable is not None else 32
    signed = variable is None or variable.data_type in SIGNED
    unsigned = variable is None or variable.data_type not in SIGNED
    low, high = -(1 << bits - 1) if signed else 0, (1 << bits - 1 + unsigned) - 1
    if not low <= value <= high:
        name = object_name(node, index, sub)
        raise DriveError(
            Problem("value", f"{value} does not fit {name}: {low} to {high}", value=value, limit=high)
        )


def object_bytes(node: int, index: int, sub: int, value: int, size: int | None = None) -> bytes:
    """A number as the bytes of an object; its size is the dictionary's unless given."""
    variable = dictionary(node).get_variable(index, sub)
    length = size or (len(variable) // 8 if variable is not None else 4)
    return (value & (1 << 8 * length) - 1).to_bytes(length, "little")


class _Answers(queue.Queue[bytes]):
    """An SDO client's queue of answers that reads the bus while one waits for it."""

    def __init__(self, bus: "Bus") -> None:
        super().__init__()
        self._bus = bus

    def get(self, block: bool = True, timeout: float | None = None) -> bytes:  # noqa: ARG002
        self._bus.until(lambda: not self.empty(), timeout or 0.0)
        return super().get(block=False)


class _Network(canopen.Network):
    def __init__(self, port: Port) -> None:
        super().__init__()
        self._port = port

    def send_message(self, can_id: int, data: bytes, remote: bool = False) -> None:  # noqa: ARG002
        self._port.send([(can_id, bytes(data))])


class Bus:
    """Seven nodes on one bus.

    ``on_frame`` gets every frame first and says whether it has dealt with it, ``background``
    is called again and again while someone waits. ``boots``
    counts boot-up messages by node, ``heard`` when a node's heartbeat came last,
    ``emergencies`` EMCY codes (node, code, register) not yet looked at.
    """

    def __init__(self, port: Port, clock: Clock) -> None:
        self.port = port
        self.clock = clock
        self.on_frame: Callable[[Frame], bool] = lambda _frame: False
        self.background: Callable[[], None] = lambda: None
        self.heard: dict[int, float] = {}
        self.states: dict[int, int] = {}
        self.boots: Counter[int] = Counter()
        self.emergencies: list[tuple[int, int, int]] = []
        self._network = _Network(port)
        self._clients: dict[int, Any] = {}
        for node in NODES:
            self._client(node)

    def command(self, code: int, node: int = 0) -> None:
        """An NMT command to one node or, with 0, to all."""
        self.port.send([(0, bytes([code, node]))])

    def pump(self) -> None:
        """Deal with all frames that have arrived."""
        now = self.clock.now()
        for frame in self.port.receive():
            if not self.on_frame(frame):
                self._dispatch(now, *frame)

    def until(self, done: Callable[[], bool], timeout: float) -> bool:
        """Read the bus until something is so, or ``timeout`` s are over; whether it is so."""
        deadline = self.clock.now() + timeout
        while True:
            self.pump()
            if done():
                return True
            if self.clock.now() >= deadline:
                return False
            self.background()
            self.clock.wait_until(self.clock.now() + SLICE)

    def read(self, node: int, index: int, sub: int = 0) -> int:
        """A number; raises Abort, DriveError when the node is silent."""
        return number_of(self.upload(node, index, sub), node, index, sub)

    def upload(self, node: int, index: int, sub: int = 0) -> bytes:
        """The bytes of an object; raises Abort, DriveError."""
        return bytes(self._transfer(node, index, sub, lambda client: client.upload(index, sub)))

    def write(self, node: int, index: int, sub: int, value: int, size: int | None = None) -> None:
        """Write a number; its size is the dictionary's unless given; raises Abort, DriveError."""
        data = object_bytes(node, index, sub, value, size)
        self._transfer(node, index, sub, lambda client: client.download(index, sub, data))

    def nodes(self) -> list[int]:
        """Ids 1-127 that answer."""
        found: set[int] = set()

        def answered(frame: Frame) -> bool:
            if 0x580 < frame[0] < 0x600:
                found.add(frame[0] - 0x580)
            return False

        self.on_frame = answered
        for _ in range(ATTEMPTS):
            self._ask_all()
            if found:
                break
        self.on_frame = lambda _frame: False
        return sorted(found)

    def _ask_all(self) -> None:
        """Ask every node id for its device type, and give the answers time."""
        request = struct.pack("<BHB4x", 0x40, 0x1000, 0)
        for first in range(1, 128, 16):
            self.port.send([(0x600 + node, request) for node in range(first, min(first + 16, 128))])
            self.until(lambda: False, SCAN / 8)
        self.until(lambda: False, SCAN)

    def forget_fault(self) -> None:
        """Nothing: every drive keeps its own fault."""

    def close(self) -> None:
        """Give the bus back."""
        self.port.close()

    def another_answer(self, node: int) -> bool:
        """Whether more than one node answered the request just made."""
        client = self._client(node)
        return self.until(lambda: not client.responses.empty(), TWIN)

    def _client(self, node: int) -> Any:
        if node not in self._clients:
            remote = canopen.RemoteNode(node, dictionary(node if node in NODES else 1))
            self._network.add_node(remote)
            remote.sdo.responses = _Answers(self)
            remote.sdo.RESPONSE_TIMEOUT = SDO_TIMEOUT
            remote.emcy.add_callback(lambda entry: self._emergency(node, entry))
            remote.nmt.add_heartbeat_callback(lambda state: self._heartbeat(node, state))
            self._clients[node] = remote.sdo
        return self._clients[node]

    def _transfer(self, node: int, index: int, sub: int, action: Callable[[Any], Any]) -> Any:
        client = self._client(node)
        client.responses = _Answers(self)
        try:
            return action(client)
        except SdoAbortedError as error:
            raise Abort(error.code, str(error)) from error
        except SdoCommunicationError as error:
            raise DriveError(
                Problem(
                    "sdo-timeout",
                    f"{node_name(node)} does not answer: {object_name(node, index, sub)}: {error}",
                    hint=f"check power, node id {node} and bit rate",
                )
            ) from error

    def _dispatch(self, now: float, cob: int, data: bytes) -> None:
        if 0x81 <= cob <= 0xFF and len(data) != 8:
            return
        if 0x581 <= cob <= 0x5FF and len(data) != 8:
            return
        if 0x701 <= cob <= 0x77F and not data:
            return
        self._network.notify(cob, bytearray(data), now)

    def _emergency(self, node: int, entry: Any) -> None:
        self.emergencies.append((node, entry.code, entry.register))

    def _heartbeat(self, node: int, state: int) -> None:
        self.heard[node] = self.clock.now()
        self.states[node] = state
        if state == 0:
            self.boots[node] += 1
