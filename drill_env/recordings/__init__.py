"""Measured runs: reading, units, checks of the time base and of the channels."""

from drill_env.recordings.angles import encoder_step
from drill_env.recordings.checks import longest_run
from drill_env.recordings.columns import CHANNELS, Channel, ColumnMap, parse_map
from drill_env.recordings.read import read_recording
from drill_env.recordings.recording import Recording, RecordingWarning

__all__ = [
    "CHANNELS",
    "Channel",
    "ColumnMap",
    "Recording",
    "RecordingWarning",
    "encoder_step",
    "longest_run",
    "parse_map",
    "read_recording",
]
