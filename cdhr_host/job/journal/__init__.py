"""The journal of a print: what was fed and what was executed, kept so that a crash cannot lose it."""

from cdhr_host.job.journal.reading import Damage, Journal, read_journal
from cdhr_host.job.journal.records import Executed, Fed, Opened, Record, Turned
from cdhr_host.job.journal.writing import JournalWriter, journal_folder, latest_unfinished, prune

__all__ = [
    "Damage",
    "Executed",
    "Fed",
    "Journal",
    "JournalWriter",
    "Opened",
    "Record",
    "Turned",
    "journal_folder",
    "latest_unfinished",
    "prune",
    "read_journal",
]
