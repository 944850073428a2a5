"""Model files in, prepared scenes out."""

from farfield_worker.prepare.limits import Limits
from farfield_worker.prepare.pipeline import prepare

__all__ = ["Limits", "prepare"]
