"""The table of states, and its drawing in the documents."""

from pathlib import Path

import pytest

from cdhr_host.errors import JobError
from cdhr_host.job.states import ASKED, MOVING, QUIET, TABLE, Word, after, drawn
from cdhr_host.job.surface import JobState

DOC = Path(__file__).parents[2] / "docs" / "job.md"


def test_the_document_draws_the_table():
    assert f"\n{drawn()}\n" in DOC.read_text()


def test_every_state_can_be_reached_and_left():
    reached = {JobState.IDLE}
    while (more := {TABLE[pair] for pair in TABLE if pair[0] in reached}) - reached:
        reached |= more
    assert reached == set(JobState)
    assert {state for state, word in TABLE if word is not Word.FAIL} == set(JobState)


def test_a_fault_is_left_only_by_an_operator():
    assert {word for state, word in TABLE if state is JobState.FAULT} == {Word.FAIL, Word.ACKNOWLEDGE}
    assert Word.ACKNOWLEDGE in ASKED


def test_a_program_moves_the_machine_or_it_does_not():
    assert not QUIET & MOVING
    assert set(JobState) - QUIET - MOVING == {JobState.PROVING, JobState.FAULT}


def test_a_word_out_of_place_is_refused_with_those_that_are_possible():
    with pytest.raises(JobError, match="'resume' is not possible while the printer is printing") as caught:
        after(JobState.PRINTING, Word.RESUME)
    assert caught.value.problems[0].hint == "possible now: hold, abort"
