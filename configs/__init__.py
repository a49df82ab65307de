"""Configs of the published runs, carried by the wheel (`dnf-pyg configs`)."""
