"""A diagnosis of recordings that its screening doubts."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from drill_env._errors import printable
from drill_env.diagnosis.result import DiagnosisResult
from drill_env.identification.screening import FATAL
from drill_env.recordings import RecordingWarning

_DOUBTED = (
    "By their signs, columns, clocks or units the recordings are of no such rig, see the warnings: "
    "what follows may come of that alone."
)


def with_remarks(result: DiagnosisResult, remarks: Sequence[RecordingWarning]) -> DiagnosisResult:
    """The result with what is doubtful about its recordings.

    Args:
        result: of `drill_env.diagnosis.diagnose`.
        remarks: of `drill_env.identification.screening.findings`.

    Returns:
        The result with the remarks, and a first sentence where no rig can make the recordings.
    """
    told = list(dict.fromkeys(printable(remark) for remark in remarks))
    doubted = any(remark.code in FATAL for remark in remarks)
    first = [_DOUBTED] if doubted else []
    return replace(result, remarks=told, sentences=[*first, *result.sentences])
