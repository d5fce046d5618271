"""The line protocol of Marlin firmware: one engine without I/O, a pseudo-terminal, a TCP port."""
