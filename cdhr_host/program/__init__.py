"""Text -> commands: one line parsed, modal state threaded through, the table of known words."""

from cdhr_host.program.block import Block, Word, print_block, print_number
from cdhr_host.program.interpreter import Interpreter
from cdhr_host.program.modal import Metadata, Modal
from cdhr_host.program.parse import parse_line
from cdhr_host.program.words import WORDS, KnownWord

__all__ = [
    "WORDS",
    "Block",
    "Interpreter",
    "KnownWord",
    "Metadata",
    "Modal",
    "Word",
    "parse_line",
    "print_block",
    "print_number",
]
