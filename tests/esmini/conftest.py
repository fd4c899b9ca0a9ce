from tests.app.conftest import sampled, workspace

__all__ = ["sampled", "workspace"]
