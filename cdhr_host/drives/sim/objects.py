"""Object dictionaries of the drives behind a bridge, for OD_READ and OD_WRITE; docs/link.md, section 9."""

import struct

from cdhr_host.drives.sim.dictionary import Abort, Dictionary
from cdhr_host.drives.sim.identity import COUPLER, identify
from cdhr_host.profile.schema import Profile

NO_NODE = 0x05040000
"""SDO protocol timed out"""
WRONG_STATE = 0x08000022


class Objects:
    """Read at any time, written only while the machine stands."""

    def __init__(self, profile: Profile) -> None:
        self._profile = profile
        self._nodes: dict[int, Dictionary] = {}

    def read(self, payload: bytes, position: tuple[int, ...], status: int) -> bytes:
        """OD_READ's payload -> OD_READ_ACK's; (6,) position units and the status word of the drives."""
        node, index, sub = struct.unpack_from("<BHB", payload)
        try:
            dictionary = self._node(node)
            if node <= len(position):
                dictionary.values[0x6064, 0] = position[node - 1]
                dictionary.values[0x6041, 0] = status
            return _answer(node, index, sub, 0, dictionary.upload((index, sub)))
        except Abort as abort:
            return _answer(node, index, sub, abort.code)

    def write(self, payload: bytes, *, standing: bool) -> bytes:
        """OD_WRITE's payload -> OD_WRITE_ACK's."""
        node, index, sub, length = struct.unpack_from("<BHBH", payload)
        try:
            if not standing:
                raise Abort(WRONG_STATE)
            self._node(node).download((index, sub), payload[6 : 6 + length])
            return _answer(node, index, sub, 0)
        except Abort as abort:
            return _answer(node, index, sub, abort.code)

    def _node(self, node: int) -> Dictionary:
        if not 1 <= node <= COUPLER:
            raise Abort(NO_NODE)
        if node not in self._nodes:
            eds = "coupler.eds" if node == COUPLER else "drive.eds"
            self._nodes[node] = identify(Dictionary(eds, node), node, self._profile)
        return self._nodes[node]


def _answer(node: int, index: int, sub: int, code: int, data: bytes = b"") -> bytes:
    return struct.pack("<BHBIH", node, index, sub, code, len(data)) + data
