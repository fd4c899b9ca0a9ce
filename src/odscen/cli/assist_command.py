"""``odscen assist``: a tool server for assistants, over standard input and output."""

from __future__ import annotations

from odscen.cli.console import WorkspaceOption


def assist(workspace: WorkspaceOption = None) -> None:
    """Serve maps, scenarios, edits, runs and pictures of the workspace to an assistant (MCP).

    An assistant starts it itself: its configuration names this command. Nothing outside the
    workspace is read or written.
    """
    from odscen.assistants import make_server
    from odscen.maps.store import Workspace

    make_server(Workspace.open(workspace)).run("stdio")
