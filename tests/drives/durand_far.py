"""Six drives and a coupler made of ``durand``, an independent CANopen slave, in place of our own."""

import canopen
from durand import Record, Variable
from durand.datatypes import DatatypeEnum
from durand.network import NetworkABC
from durand.node import MinimalNode
from durand.scheduler import VirtualScheduler, set_scheduler

from cdhr_host.drives.canopen.bus import dictionary

OWN = {0x1000, 0x1008, 0x100A, 0x1018, 0x1005, 0x1017, 0x1014, 0x1001, 0x1003, 0x1015}
LACKS = {0x1006, 0x1016, 0x1019, 0x1029}
UP = {(0x40, 0x06): 0x21, (0x21, 0x07): 0x23, (0x23, 0x0F): 0x27, (0x27, 0x07): 0x23, (0x23, 0x06): 0x21}


class Wire(NetworkABC):
    def __init__(self):
        self.subscriptions, self.outbox = {}, []

    def add_subscription(self, cob_id, callback):
        self.subscriptions.setdefault(cob_id, []).append(callback)

    def remove_subscription(self, cob_id):
        self.subscriptions.pop(cob_id, None)

    def send(self, cob_id, msg):
        self.outbox.append((cob_id, bytes(msg)))


def _variable(entry, start=None):
    access = "rw" if entry.access_type.startswith("rw") else "ro"
    value = entry.default if start is None else start
    return Variable(DatatypeEnum(entry.data_type), access, value or 0, name=entry.name)


def _fill(node, number, identity):
    """The objects of our EDS that durand does not have itself."""
    od = node.object_dictionary
    for index, entry in dictionary(number).items():
        if index in OWN | LACKS or 0x1400 <= index < 0x1C00:
            continue
        if isinstance(entry, canopen.objectdictionary.ODVariable):
            od[index] = _variable(entry)
        else:
            record = Record(name=entry.name)
            for sub, variable in entry.subindices.items():
                if sub:
                    record[sub] = _variable(variable)
            od[index] = record
    for (index, sub), value in identity.items():
        od.write(index, sub, value)


class DurandDrive:
    def __init__(self, wire, number, identity):
        self.node = MinimalNode(wire, number)
        _fill(self.node, number, identity | {(0x1000, 0): 0x20192, (0x6092, 1): 40000})
        self.od = self.node.object_dictionary
        self.state = 0x40
        self.od.write(0x6041, 0, 0x250)
        self.od.download_callbacks[(0x6060, 0)].add(lambda mode: self.od.write(0x6061, 0, mode))
        self.node.sync.callbacks.add(self.on_sync)

    def on_sync(self):
        word = self.od.read(0x6040, 0) & 0x0F
        self.state = 0x40 if not word & 2 else UP.get((self.state, word), self.state)
        if self.state == 0x27:
            self.od.write(0x6064, 0, self.od.read(0x607A, 0))
            self.od.write(0x6077, 0, self.od.read(0x60B2, 0))
        self.od.write(0x6041, 0, 0x210 | self.state | (0x1000 if self.state == 0x27 else 0))


class DurandStation:
    """Same face as the simulated station, as far as the contract needs it."""

    def __init__(self, profile):
        settings = profile.canopen
        self.scheduler = VirtualScheduler()
        set_scheduler(self.scheduler)
        self.wire = Wire()
        self.drives = [
            DurandDrive(
                self.wire,
                k + 1,
                {
                    (0x1018, 1): settings.drive_vendor,
                    (0x1018, 2): settings.drive_product,
                    (0x1018, 4): serial,
                },
            )
            for k, serial in enumerate(settings.drive_serials)
        ]
        self.coupler = MinimalNode(self.wire, 7)
        identity = {(0x1018, 1): settings.io_vendor, (0x1018, 2): settings.io_product}
        _fill(self.coupler, 7, identity | {(0x1000, 0): 0xF0191, (0x6000, 1): 3})
        self.coupler.sync.callbacks.add(self._coupled)
        self._now = None

    def start(self, now):
        self._now = now

    def exchange(self, now, frames):
        self.scheduler.run(now - self._now)
        self._now = now
        for cob, data in frames:
            for callback in list(self.wire.subscriptions.get(cob, [])):
                callback(cob, data)
        sent, self.wire.outbox = self.wire.outbox, []
        return sent

    def _coupled(self):
        od = self.coupler.object_dictionary
        od.write(0x6401, 1, od.read(0x6411, 1))
