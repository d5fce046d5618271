"""``python -m cdhr_host`` is ``cdhr``."""

from cdhr_host.cli import main

if __name__ == "__main__":
    main()
