"""Lines, numbers, checksums, answers: what each Marlin client relies on."""

from dataclasses import replace
from pathlib import Path

import pytest
from marlin_client import Client, checked, with_client


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


@pytest.mark.parametrize("known", [True, False])
def test_g28_homes_a_machine_that_is_not_referenced_before_anything_is_streamed(
    tmp_path: Path, known: bool
) -> None:
    async def act(client: Client) -> None:
        surface = client.surface
        surface._status = replace(surface.status(), referenced=known)
        said = client.say("G28\n")
        said += await client.settle()
        assert said == ["ok"]
        assert ("run", "G28") in surface.said or known
        assert bool(surface.feeds) == known

    with_client(act, tmp_path)
