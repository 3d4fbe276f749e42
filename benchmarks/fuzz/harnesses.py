"""Every harness by its reader's name."""

from benchmarks.fuzz import asked, documents, logs, recorded, trained

HARNESSES = {
    harness.name: harness
    for harness in (
        recorded.CSV, recorded.GZIP, recorded.PARQUET, recorded.MAT, logs.JSON,
        recorded.FOLDER,
        documents.RIG, documents.EFFECTS, documents.ESTIMATE, asked.CONFIG, asked.RESET,
        asked.ACTION,
        asked.LINES, trained.POLICY, trained.CHECKPOINT,
    )
}  # fmt: skip
