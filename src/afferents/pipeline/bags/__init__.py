"""Recordings as ROS 2 bags in MCAP files, and bags as recordings; no ROS is needed."""

from afferents.pipeline.bags.export import McapExport, export_mcap
from afferents.pipeline.bags.reading import Bag, bag_files, is_bag

__all__ = ["Bag", "McapExport", "bag_files", "export_mcap", "is_bag"]
