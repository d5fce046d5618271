"""The journal of a print: what was fed and what was executed, kept so that a crash cannot lose it."""

from cdhr_host.job.journal.reading import Damage, Journal, read_journal
from cdhr_host.job.journal.records import Executed, Fed, Opened, Record, Turned
from cdhr_host.job.journal.writing import (
    SYNC_EVERY,
    JournalWriter,
    boot_name,
    journal_folder,
    latest_unfinished,
    prune,
)

__all__ = [
    "SYNC_EVERY",
    "Damage",
    "Executed",
    "Fed",
    "Journal",
    "JournalWriter",
    "Opened",
    "Record",
    "Turned",
    "boot_name",
    "journal_folder",
    "latest_unfinished",
    "prune",
    "read_journal",
]
