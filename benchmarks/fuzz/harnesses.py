"""Every harness by its reader's name."""

from benchmarks.fuzz import documents, logs, recorded, trained

HARNESSES = {
    harness.name: harness
    for harness in (
        recorded.CSV, recorded.GZIP, recorded.PARQUET, recorded.MAT, logs.JSON,
        recorded.FOLDER,
        documents.RIG, documents.EFFECTS, documents.ESTIMATE, documents.CONFIG, documents.RESET,
        documents.ACTION,
        documents.LINES, trained.POLICY, trained.CHECKPOINT,
    )
}  # fmt: skip
