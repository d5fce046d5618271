import asyncio
from collections.abc import Callable
from pathlib import Path

import pytest
from serve_surface import ScriptedSurface

from cdhr_host.errors import Problem
from cdhr_host.job.surface import JobState
from cdhr_host.serve.folder import Folder
from cdhr_host.serve.host import Host
from cdhr_host.serve.marlin.bench import Bench
from cdhr_host.serve.marlin.engine import QUEUE_MAX, Engine
from cdhr_host.serve.script import Executor
from cdhr_host.serve.streaming import Streams


def checked(number: int, text: str) -> bytes:
    body = f"N{number} {text}".encode()
    value = 0
    for byte in body:
        value ^= byte
    return body + f"*{value}\n".encode()


class Client:
    """A client, its engine, and a clock of its own."""

    def __init__(self, tmp_path: Path, room: int = 32) -> None:
        self.surface = ScriptedSurface(room)
        self.folder = Folder(tmp_path / "programs")
        self.host = Host(self.surface, self.folder)
        self.host.open()
        self.executor = Executor(self.host)
        self.streams = Streams(self.host)
        self.now = 100.0
        self.engine = self.another()

    def another(self) -> Engine:
        return Engine(Bench(self.host, self.executor, self.streams, "a test"))

    def say(self, data: bytes | str) -> list[str]:
        self.engine.receive(data.encode() if isinstance(data, str) else data, self.now)
        return self.heard()

    def wait(self, seconds: float = 0.0) -> list[str]:
        self.now += seconds
        self.engine.tick(self.now)
        return self.heard()

    def heard(self) -> list[str]:
        return self.engine.take().decode().splitlines()

    async def settle(self) -> list[str]:
        for _ in range(8):
            await asyncio.sleep(0)
        return self.wait()


def with_client(act: Callable[[Client], object], tmp_path: Path, **more: int) -> None:
    async def run() -> None:
        client = Client(tmp_path, **more)
        made = act(client)
        if asyncio.iscoroutine(made):
            await made
        await client.host.close()

    asyncio.run(run())


def test_hello_of_each_client(tmp_path: Path) -> None:
    def act(client: Client) -> None:
        assert client.say("N0 M110 N0*125\nN0 M110 N0*125\n") == ["ok", "ok"]
        assert client.say("\n") == []
        assert client.say(b"\0" * 100 + b"\n") == []
        (answer,) = client.say("M105\n")
        assert answer == "ok T:0.0 /0.0 B:0.0 /0.0 P:2.50 /0.00 @:0 B@:0"

    with_client(act, tmp_path)


@pytest.mark.parametrize(
    ("hello", "following"),
    [
        (b"N-1 M110 N-1*125\n", 0),
        (b"N-1 M110*15\n", 0),
        (b"N0M110*3\n", 1),
        (b"M110 N-1\n", 0),
        (b"M110 N41\n", 42),
        (b"N0 M110 N0*125\n", 1),
    ],
)
def test_every_form_of_m110_sets_the_number(tmp_path: Path, hello: bytes, following: int) -> None:
    def act(client: Client) -> None:
        assert client.say(hello) == ["ok"]
        assert client.say(checked(following, "M105"))[0].startswith("ok T:")
        assert client.say(checked(following, "M105"))[1] == f"Resend: {following + 1}"

    with_client(act, tmp_path)


def test_a_damaged_line_comes_again_and_counts_once(tmp_path: Path) -> None:
    def act(client: Client) -> None:
        client.say(b"M110 N0\n")
        assert client.say(b"N1 G1 X1 F600*99\n") == [
            "Error:checksum mismatch, Last Line: 0",
            "Resend: 1",
            "ok",
        ]
        in_flight = b"".join(checked(n, f"G1 X{n}") for n in (2, 3, 4))
        assert client.say(in_flight) == ["ok"] * 3
        again = b"".join(checked(n, f"G1 X{n} F600") for n in (1, 2, 3, 4))
        assert client.say(again) == ["ok"] * 4
        moves = [line for line in client.surface.feeds[0].lines if " X" in line]
        assert moves == [f"G1 X{n} F600" for n in (1, 2, 3, 4)]

    with_client(act, tmp_path)


def test_a_client_that_missed_the_resend_is_asked_again(tmp_path: Path) -> None:
    def act(client: Client) -> None:
        client.say(b"M110 N0\nN1 M105\n")
        answers = [client.say(checked(n, "M105")) for n in range(2, 20)]
        assert any("Resend: 1" in answer for answer in answers)
        assert all(answer[-1] == "ok" for answer in answers)

    with_client(act, tmp_path)


def test_a_number_without_checksum_comes_again(tmp_path: Path) -> None:
    def act(client: Client) -> None:
        assert client.say("N1 M105\n")[1:] == ["Resend: 1", "ok"]
        assert client.say("N1G28*50\n") == ["ok"]

    with_client(act, tmp_path)


def test_identity_is_one_block_without_words_that_switch_quirks(tmp_path: Path) -> None:
    def act(client: Client) -> None:
        answer = client.say("M115\n")
        assert answer[0].startswith("FIRMWARE_NAME:cdhr_host ")
        assert all(line.startswith("Cap:") for line in answer[1:-1])
        assert answer[-1] == "ok"
        quirks = ("repetier", "reprapfirmware", "malyan", "teacup", "ultimaker2", "klipper", "prusa-firmware")
        assert not [word for word in quirks if word in "\n".join(answer).lower()]

    with_client(act, tmp_path)


def test_position_has_e(tmp_path: Path) -> None:
    def act(client: Client) -> None:
        position, ok = client.say("M114\n")
        assert position.startswith("X:0.000 Y:0.000 Z:0.000 E:0.000 Count X:")
        assert ok == "ok"

    with_client(act, tmp_path)


def test_a_full_machine_answers_when_there_is_room_and_says_busy(tmp_path: Path) -> None:
    def act(client: Client) -> None:
        text = "".join(f"G1 X{n} F600\n" for n in range(20))
        room = client.surface.room - 4
        assert client.say(text) == ["ok"] * room
        assert client.wait(1.0) == []
        assert client.wait(1.1) == ["echo:busy: processing"]
        client.surface.advance(3)
        assert client.wait(0.1) == ["ok"] * 3

    with_client(act, tmp_path, room=10)


def test_m400_waits_for_the_end_of_the_motion(tmp_path: Path) -> None:
    def act(client: Client) -> None:
        assert client.say("G1 X1 F600\nM400\n") == ["ok"]
        assert client.wait(2.1) == ["echo:busy: processing"]
        client.surface.advance(99)
        assert client.wait() == ["ok"]

    with_client(act, tmp_path)


def test_emergency_words_act_before_the_queue_also_numbered(tmp_path: Path) -> None:
    def act(client: Client) -> None:
        client.say("".join(f"G1 X{n} F600\n" for n in range(20)))
        client.heard()
        heard = client.say(checked(8, "M112"))
        assert client.surface.said[-1] == ("stop", "emergency stop from a test")
        assert heard[0] == "Error:Printer halted. kill() called! emergency stop from a test"

    with_client(act, tmp_path, room=10)


def test_m108_goes_on_after_a_pause_of_the_program(tmp_path: Path) -> None:
    def act(client: Client) -> None:
        assert client.say("G1 X1 F600\nM0 change the clay\n") == ["ok"]
        client.surface.advance(99)
        client.surface.hold("change the clay")
        assert "//action:paused" in client.wait()
        assert client.wait(2.1) == ["echo:busy: paused for user"]
        assert client.say(checked(8, "M108"))[:2] == ["//action:prompt_end", "//action:resumed"]

    with_client(act, tmp_path)


def test_motors_never_let_go_and_limits_never_rise(tmp_path: Path) -> None:
    def act(client: Client) -> None:
        for word in ("M84", "M18 X Y"):
            assert client.say(f"{word}\n") == [
                f"echo:{word.split()[0]}: motors stay on, they hold the cables' tension",
                "ok",
            ]
        assert "limits come from its profile" in client.say("M203 X5000\n")[0]
        assert client.surface.feeds == []

    with_client(act, tmp_path)


def test_a_heater_is_never_waited_for(tmp_path: Path) -> None:
    def act(client: Client) -> None:
        assert client.say("M104 T0 S0\nM140 S0\nM109 S200\nM190 S60\nT0\n") == ["ok"] * 5

    with_client(act, tmp_path)


def test_unknown_words_are_told_and_answered(tmp_path: Path) -> None:
    def act(client: Client) -> None:
        assert client.say("M9999 X1\n") == ['echo:Unknown command: "M9999 X1"', "ok"]
        assert client.say(b"\xff\xfe\x01garbage\x7f\n")[-1] == "ok"

    with_client(act, tmp_path)


def test_a_typed_line_with_a_slip_is_refused_at_once(tmp_path: Path) -> None:
    def act(client: Client) -> None:
        refusal, ok = client.say("G1 X1..5\n")
        assert refusal.startswith("echo:")
        assert "is not a number" in refusal
        assert ok == "ok"
        assert client.surface.feeds == []

    with_client(act, tmp_path)


def test_a_long_line_is_dropped_as_a_whole(tmp_path: Path) -> None:
    def act(client: Client) -> None:
        assert client.say("G1 X1" + "0" * 5000)[:1] == []
        assert client.say("\nM105\n")[:2] == ["echo:a line longer than 1024 bytes was dropped", "ok"]

    with_client(act, tmp_path)


def test_reports_come_when_asked_for(tmp_path: Path) -> None:
    def act(client: Client) -> None:
        assert client.say("M155 S2\nM154 S5\n")[:2] == ["ok", "ok"]
        client.wait(5.0)
        assert client.wait(2.0) == [" T:0.0 /0.0 B:0.0 /0.0 P:2.50 /0.00 @:0 B@:0"]
        assert client.say("M155 S0\nM154 S0\n") == ["ok", "ok"]
        assert client.wait(60.0) == []

    with_client(act, tmp_path)


def test_the_client_is_told_of_a_hold_by_somebody_else(tmp_path: Path) -> None:
    def act(client: Client) -> None:
        client.say("G1 X1 F600\n")
        client.surface.hold("cable 2 is slack")
        assert client.wait()[:2] == ["//action:paused", "//action:notification cable 2 is slack"]
        client.surface.resume()
        assert client.wait()[-1] == "//action:resumed"
        client.surface.abort()
        assert client.wait()[-1] == "//action:cancel"

    with_client(act, tmp_path)


def test_a_choice_in_a_prompt_goes_on_or_ends(tmp_path: Path) -> None:
    def act(client: Client) -> None:
        client.say("M876 P1\nG1 X1 F600\n")
        client.surface.hold("a pause")
        told = client.wait()
        assert told[-4:] == [
            "//action:prompt_begin a pause",
            "//action:prompt_button Resume",
            "//action:prompt_button Cancel",
            "//action:prompt_show",
        ]
        client.say("M876 S0\n")
        assert client.surface.said[-1] == ("resume",)

    with_client(act, tmp_path)


def test_m118_can_be_a_host_action(tmp_path: Path) -> None:
    def act(client: Client) -> None:
        assert client.say("M118 A1 action:pause\n") == ["//action:pause", "ok"]
        assert client.say("M118 E1 hello there\n") == ["echo:hello there", "ok"]

    with_client(act, tmp_path)


def test_a_vanished_client_means_hold_only_while_it_printed(tmp_path: Path) -> None:
    def act(client: Client) -> None:
        client.say("G1 X1 F600\nG1 X2\n")
        client.engine.closed()
        assert client.surface.said[-1][0] == "hold"
        client.surface.resume()
        client.surface.advance(99)
        assert client.surface.status().state is JobState.DONE
        client.engine = client.another()
        client.say("G1 X1 F600\n")
        client.surface.advance(99)
        client.engine.closed()
        assert client.surface.status().state is JobState.DONE

    with_client(act, tmp_path)


def test_a_silent_client_ends_its_stream_only_at_rest(tmp_path: Path) -> None:
    def act(client: Client) -> None:
        client.say("G1 X1 F600 E3\n")
        client.wait(1000.0)
        assert client.surface.status().state is JobState.PRINTING
        client.surface.advance(99)
        client.wait(1000.0)
        assert client.surface.status().state is JobState.DONE
        client.say("G1 X2 E4\n")
        assert client.surface.feeds[1].lines == [
            "G21",
            "G90",
            "M82",
            "G92 E3.000000",
            "G1 F600.000000",
            "G1 X2 E4",
        ]

    with_client(act, tmp_path)


def test_only_one_client_prints(tmp_path: Path) -> None:
    def act(client: Client) -> None:
        client.say("G1 X1 F600\n")
        other = client.another()
        other.receive(b"G1 X5 F600\n", client.now)
        refusal, ok = other.take().decode().splitlines()
        assert "another client is printing" in refusal
        assert ok == "ok"
        assert "G1 X5 F600" not in client.surface.feeds[0].lines

    with_client(act, tmp_path)


def test_a_flood_stops_the_reading_not_the_memory(tmp_path: Path) -> None:
    def act(client: Client) -> None:
        while not client.engine.full:
            client.engine.receive(b"G1 X1 F600\n" * 64, client.now)
            client.engine.take()
        assert len(client.surface.feeds[0].lines) <= client.surface.room
        client.surface.room = 10**6
        heard = client.wait()
        assert heard == ["ok"] * len(heard)
        assert len(heard) >= QUEUE_MAX

    with_client(act, tmp_path)


def test_a_client_that_does_not_read_loses_no_ok(tmp_path: Path) -> None:
    def act(client: Client) -> None:
        sent = 0
        while not client.engine.full:
            client.engine.receive(b"M115\n" * 50, client.now)
            sent += 50
        oks = 0
        while heard := client.wait():
            oks += heard.count("ok")
        assert oks == sent

    with_client(act, tmp_path)


async def _print_from_card(client: Client) -> None:
    with client.folder.receive("Ring 1.gcode") as upload:
        upload.write(b"G1 X1 F600\nG1 X2\nG1 X3\n")
        upload.keep()
    listed = client.say("M20\n")
    assert listed[1] == 'Ring_1.gcode 23 "Ring 1.gcode"'
    assert client.say("M23 ring_1.gcode\n")[:2] == ["File opened: Ring 1.gcode Size: 23", "File selected"]
    assert client.say("M24\n") == ["ok"]
    await client.settle()
    client.surface.advance(0)
    await asyncio.sleep(0.01)
    client.surface.advance(1)
    assert client.say("M27\n")[-2:] == ["SD printing byte 7/23", "ok"]
    client.surface.advance(5)
    assert "Done printing file" in client.wait()
    assert client.say("M27\n") == ["Not SD printing", "ok"]
    refusal, ok = client.say("M30 Ring 1.gcode\n")
    assert "refused" in refusal
    assert ok == "ok"


def test_the_upload_folder_is_the_card(tmp_path: Path) -> None:
    with_client(_print_from_card, tmp_path)


async def _refused_from_card(client: Client) -> None:
    with client.folder.receive("bad.gcode") as upload:
        upload.write(b"G1 X1 F600\nG77 X2\n")
        upload.keep()
    assert client.say("M32 !bad.gcode\n")[-1] == "ok"
    await client.settle()
    client.surface.advance(0)
    heard = await client.settle()
    await asyncio.sleep(0.01)
    heard += client.wait()
    assert any("line 2: unknown word G77" in line for line in heard)
    assert not [line for line in heard if line.startswith(("Error", "!!"))]


def test_a_refused_file_says_why_and_is_no_halt(tmp_path: Path) -> None:
    with_client(_refused_from_card, tmp_path)


def test_problems_while_streaming_are_no_errors(tmp_path: Path) -> None:
    async def act(client: Client) -> None:
        client.say("G1 X1 F600\n")
        client.surface.go(JobState.HELD, "refused", Problem("bed", "outside the bed", line=2))
        heard = await client.settle()
        assert "//action:paused" in heard
        assert any("outside the bed" in line for line in heard)
        assert not [line for line in heard if line.startswith(("Error", "!!"))]

    with_client(act, tmp_path)
