"""An extracted store as a file of Neurodata Without Borders (NWB)."""

from afferents.pipeline.nwb.export import NwbExport, export_nwb

__all__ = ["NwbExport", "export_nwb"]
