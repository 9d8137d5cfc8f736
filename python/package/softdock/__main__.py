"""The command ``softdock``: the same program as the one built by cargo."""

import sys

from softdock import _softdock


def main() -> None:
    """Run the command of ``sys.argv`` and exit with its code."""
    import signal

    # The program handles Ctrl-C itself.
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    sys.exit(_softdock.command(["softdock", *sys.argv[1:]]))


if __name__ == "__main__":
    main()
