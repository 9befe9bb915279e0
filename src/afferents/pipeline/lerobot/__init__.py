"""Stores as LeRobot data sets, version 3.0 of their format."""

from afferents.pipeline.lerobot.export import LeRobotExport, export_lerobot

__all__ = ["LeRobotExport", "export_lerobot"]
