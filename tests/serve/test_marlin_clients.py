"""Clients over time: reports, holds, prompts, floods, departures, the memory card."""

import asyncio
from pathlib import Path

from marlin_client import Client, with_client

from cdhr_host.errors import JobError, Problem
from cdhr_host.job.surface import JobState, LineFeed
from cdhr_host.serve.marlin.engine import QUEUE_MAX


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


def test_lines_as_other_senders_write_them(tmp_path: Path) -> None:
    def act(client: Client) -> None:
        assert client.say("g1x2f600\r\nG01 X3. ; a comment *5\rG1 X4\r\n") == ["ok", "ok", "ok"]
        assert client.surface.feeds[0].lines[-3:] == ["g1x2f600", "G01 X3.", "G1 X4"]

    with_client(act, tmp_path)


def test_a_line_sent_while_something_else_moves_waits_for_it(tmp_path: Path) -> None:
    def act(client: Client) -> None:
        opened = client.surface.open_stream

        def busy(_: str) -> LineFeed:
            raise JobError(Problem("busy", "the machine still moves", hint="wait until it stands"))

        client.surface.open_stream = busy
        assert client.say("G28\n") == []
        assert client.wait(2.5) == ["echo:busy: processing"]
        client.surface.open_stream = opened
        assert client.wait() == ["ok"]
        assert client.surface.feeds[0].lines[-1] == "G28"

    with_client(act, tmp_path)
