"""A printer for other people's clients: Marlin's line protocol, HTTP, Klipper's socket."""
