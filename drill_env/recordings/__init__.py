"""Measured runs: reading, units, checks of the time base and of the channels."""

from drill_env.recordings.angles import encoder_step
from drill_env.recordings.checks import longest_run
from drill_env.recordings.columns import ColumnMap, parse_map
from drill_env.recordings.manifest import RecordingSet, read_folder
from drill_env.recordings.manifest_entries import RecordingSettings, Role
from drill_env.recordings.read import read_recording
from drill_env.recordings.recording import Drive, Recording, RecordingWarning
from drill_env.recordings.signals import SIGNAL_KINDS, Signal, parse_signal, signal_samples
from drill_env.recordings.units import CHANNELS, Channel

__all__ = [
    "CHANNELS",
    "SIGNAL_KINDS",
    "Channel",
    "ColumnMap",
    "Drive",
    "Recording",
    "RecordingSet",
    "RecordingSettings",
    "RecordingWarning",
    "Role",
    "encoder_step",
    "longest_run",
    "Signal",
    "parse_map",
    "parse_signal",
    "read_folder",
    "read_recording",
    "signal_samples",
]
