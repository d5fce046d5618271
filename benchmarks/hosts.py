"""Hosts as real processes at a terminal: ``cdhr stream``, ``cdhr resume``, and what they say."""

import os
import re
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np

from cdhr_host.cli.app import app
from cdhr_host.errors import JobError
from cdhr_host.job.journal import read_journal
from cdhr_host.profile import find

ROOT = Path(__file__).resolve().parents[1]
PATIENCE = 900.0
"""s a busy computer may take for anything"""
LOOK = 0.05
SETTINGS = {"setpoint_watchdog_ms": 100.0, "jitter_test_ms": 100.0}
"""for a computer that does other things besides"""


class LateError(Exception):
    """Something took longer than PATIENCE."""


def tolerant(folder, name, **settings):
    """A shipped profile, with SETTINGS and these; its path."""
    text = find(name).read_text()
    for key, value in (SETTINGS | settings).items():
        text = re.sub(rf"(?m)^{key} = .*$", f"{key} = {value}", text)
    path = Path(folder) / f"{name}-soak.toml"
    path.write_text(text)
    return path


def until(what, found, patience=PATIENCE):
    """Look until something is found, and return that."""
    end = time.monotonic() + patience
    while time.monotonic() < end:
        if (answer := found()) is not None:
            return answer
        time.sleep(LOOK)
    raise LateError(what)


class FarSide:
    """``far_side.py``, started."""

    def __init__(self, folder, profile, bus="slcan"):
        self.link, self.file = folder / "machine", folder / "far.rec"
        script = [sys.executable, str(ROOT / "benchmarks" / "far_side.py"), "--bus", bus]
        where = ["--profile", str(profile), "--link", str(self.link), "--record", str(self.file)]
        self.process = subprocess.Popen(
            [*script, *where], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, env=environment()
        )
        self.url = self.process.stdout.readline().strip()

    def say(self, word):
        self.process.stdin.write(word + "\n")
        self.process.stdin.flush()

    def end(self):
        """Cycles in which a drive had to guess."""
        self.say("end")
        lost = int(self.process.stdout.readline())
        self.process.wait(PATIENCE)
        return lost

    @property
    def written(self):
        """Bytes of the record so far."""
        return self.file.stat().st_size


def environment(**more):
    return {**os.environ, "PYTHONPATH": str(ROOT), **{name: str(value) for name, value in more.items()}}


class Forked:
    """A process of its own that is ``cdhr`` without having to import it again; as ``subprocess.Popen``."""

    def __init__(self, arguments, stdin, stderr, env):
        self.returncode = None
        self.pid = os.fork()
        if self.pid == 0:
            self._be(arguments, stdin, stderr, env)

    @staticmethod
    def _be(arguments, stdin, stderr, env):
        code = 1
        try:
            os.setsid()
            os.environ.update(env)
            nothing = os.open(os.devnull, os.O_WRONLY)
            for number, wanted in enumerate((stdin, nothing, stderr.fileno())):
                os.dup2(wanted, number)
            sys.stdin, sys.stdout, sys.stderr = open(0), open(1, "w"), open(2, "w", buffering=1)  # noqa: SIM115
            app(list(map(str, arguments)), prog_name="cdhr")
            code = 0
        except SystemExit as end:
            code = end.code or 0
        finally:
            os._exit(code)

    def poll(self):
        if self.returncode is None:
            pid, status = os.waitpid(self.pid, os.WNOHANG)
            if pid:
                self.returncode = os.waitstatus_to_exitcode(status)
        return self.returncode

    def wait(self, patience):
        until("its end", lambda: True if self.poll() is not None else None, patience)
        return self.returncode

    def send_signal(self, number):
        if self.poll() is None:
            os.kill(self.pid, number)

    def kill(self):
        self.send_signal(signal.SIGKILL)


class Host:
    """One ``cdhr`` at a pseudo-terminal of its own; keys go in, messages into a file."""

    def __init__(self, folder, number, arguments, *, forked=False):
        self.keys, terminal = os.openpty()
        self.said_in, self.state = folder / f"host{number:04}.txt", folder / "state"
        self.before = set(self._journals())
        env = environment(XDG_STATE_HOME=self.state)
        with self.said_in.open("w") as said:
            if forked:
                self.process = Forked(arguments, terminal, said, env)
            else:
                self.process = subprocess.Popen(
                    [sys.executable, "-m", "cdhr_host", *map(str, arguments)],
                    stdin=terminal,
                    stdout=subprocess.DEVNULL,
                    stderr=said,
                    env=env,
                    start_new_session=True,
                )
        os.close(terminal)
        self.began = time.monotonic()

    def _journals(self):
        return (self.state / "cdhr" / "journals").glob("*.journal")

    @property
    def said(self):
        return self.said_in.read_text()

    @property
    def ended(self):
        return self.process.poll()

    @property
    def journal(self):
        """This host's, as it is now; None before there is one."""
        new = sorted(set(self._journals()) - self.before)
        try:
            return read_journal(new[-1]) if new else None
        except JobError:
            return None

    def begun(self, *, under_way=True):
        """Wait for its end, or its journal and, if ``under_way``, for the program to be executed."""

        def found():
            journal = self.journal
            there = journal is not None and (journal.executed is not None or not under_way)
            return True if there or self.ended is not None else None

        until(f"a beginning: {self.said}", found)
        self.began = time.monotonic()

    def becomes(self, *states):
        """Wait for a state of its job, or its end."""
        until(
            f"{states}: {self.said}",
            lambda: self.ended if self.ended is not None else self.journal.state in states or None,
        )

    def press(self, keys):
        os.write(self.keys, keys)

    def gone(self):
        """Wait until nothing of it is left; its exit code."""
        code = self.process.wait(PATIENCE)
        until("the sender's end", self._alone)
        os.close(self.keys)
        return code

    def _alone(self):
        """True once no process of its session lives; who has died and is not waited for does not."""
        for status in Path("/proc").glob("[0-9]*/stat"):
            try:
                state, _, _, session = status.read_text().rsplit(") ", 1)[1].split()[:4]
            except OSError:
                continue
            if int(session) == self.process.pid and state not in "ZX":
                return None
        return True

    @property
    def resident(self):
        """kB of the process; None when it is gone."""
        return resident(self.process.pid)

    def seam(self):
        """(3,) m and m: the place and the overlap that ``cdhr resume`` told; None if it told none."""
        place = re.search(r"X(-?[\d.]+) Y(-?[\d.]+) Z(-?[\d.]+)", self.said)
        overlap = re.search(r"overlap +([\d.]+) mm", self.said)
        if place is None or overlap is None:
            return None
        return np.array([float(each) for each in place.groups()]) / 1e3, float(overlap[1]) / 1e3


def resident(pid):
    try:
        text = Path(f"/proc/{pid}/status").read_text()
    except OSError:
        return None
    found = re.search(r"VmRSS:\s+(\d+)", text)
    return int(found[1]) if found else None
