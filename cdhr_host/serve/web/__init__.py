"""One HTTP port: OctoPrint's uploads, Moonraker's methods and websocket, a page of our own."""
