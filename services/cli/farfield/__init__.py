"""The farfield command."""
