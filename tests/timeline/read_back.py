"""A time line as Rerun's own reader has it."""

import pytest

pytest.importorskip("rerun", reason="rerun-sdk is not installed: pip install 'riseg-drake[rerun]'")


def rows(file):
    """By entity, a row for each time that it was logged: the time, s (None: always), and its components."""
    from rerun.chunk import RrdReader

    entities = {}
    for chunk in RrdReader(str(file)).stream():
        batch = chunk.to_record_batch()
        content = {n.partition(":")[2]: batch.column(n).to_pylist() for n in batch.schema.names if ":" in n}
        timed = "time" in batch.schema.names  # in ns
        times = batch.column("time").cast("int64").to_pylist() if timed else [None] * batch.num_rows
        there = entities.setdefault(chunk.entity_path.lstrip("/"), [])
        for k, time in enumerate(times):
            row = {name: values[k] for name, values in content.items() if values[k] is not None}
            there.append((None if time is None else time / 1e9, row))
    return {name: sorted(each, key=lambda row: row[0] or 0.0) for name, each in entities.items()}
