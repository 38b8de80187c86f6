"""The command `mbody edit`: the drawing board, a page on this machine."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from mbody.cli.interrupts import interrupt
from mbody.cli.streams import UsageError


def edit(args: Any) -> int:
    """Draw a mechanism, drag it and read its forces, on a page that is for this machine alone."""
    from mbody.edit.session import BoardServer, BoardSession

    port = args.port or 0
    session = BoardSession(Path.cwd(), args.model)
    try:
        server = BoardServer(session, port)
    except (OSError, OverflowError) as error:
        why = getattr(error, "strerror", None) or "ports end at 65535"
        raise UsageError(f"port {port} cannot be listened on ({why}): leave --port out") from None
    print(server.address, flush=True)
    if not args.no_open:
        import webbrowser

        webbrowser.open(server.address)
    try:
        server.serve(interrupt.mark, keep=args.keep)
    except KeyboardInterrupt:
        pass
    finally:
        interrupt.done()
    return 0
