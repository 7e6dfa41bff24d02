"""The forms that a plan can leave in: one file and one line here each."""

from planner.export import csv, json, ros2
from planner.export.base import INCLUDABLE, ExportOptions, Format

FORMATS: dict[str, Format] = {
    form.name: form
    for form in (
        json.FORMAT,
        csv.FORMAT,
        ros2.FORMAT,
    )
}
"""Every format by its name; the first is the default."""

__all__ = ["FORMATS", "INCLUDABLE", "ExportOptions", "Format"]
