"""Run by the clients' Python: printcore prints a file. Arguments: PORT FILE; prints one JSON object."""

import json
import sys
import time
from pathlib import Path

from printrun import gcoder
from printrun.printcore import printcore


def wait(reached, seconds):
    end = time.monotonic() + seconds
    while not reached():
        if time.monotonic() > end:
            return False
        time.sleep(0.02)
    return True


heard = []
core = printcore()
core.recvcb = lambda line: heard.append(line.strip())
core.connect(sys.argv[1], 115200)
online = wait(lambda: core.online, 60)
program = gcoder.LightGCode(Path(sys.argv[2]).read_text().splitlines())
core.startprint(program)
sent = wait(lambda: not core.printing, 120)
core.send_now("M400")
core.send_now("M114")
stands = wait(lambda: any(line.startswith("X:") for line in heard), 60)
core.disconnect()
where = next((line for line in heard if line.startswith("X:")), "")
errors = [line for line in heard if line.startswith(("Error", "!!", "Resend"))]
print(json.dumps({"online": online, "sent": sent, "stands": stands, "where": where, "errors": errors}))
