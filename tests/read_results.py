"""Reads a results folder as a user would, with pyarrow and with DuckDB: `python3 tests/read_results.py RESULTS_DIR`.

Prints the counts by status and by agreement from both readers and fails if they differ, if a column lacks its
unit, description, source or kind, or if a file's metadata do not say where it comes from.
"""

import collections
import pathlib
import sys

import duckdb
import pyarrow.parquet as pq

COLUMN_KEYS = (b"unit", b"description", b"source", b"kind")
FILE_KEYS = ("schema", "campaign_hash", "seed", "version", "backend", "device", "shard", "rows", "content_hash")


def check_metadata(path):
    """Returns what the file's metadata lack, in words."""
    schema = pq.read_schema(path)
    of_file = schema.metadata or {}
    lacking = [f"{path.name}: no softdock.{key}" for key in FILE_KEYS if f"softdock.{key}".encode() not in of_file]
    for field in schema:
        found = field.metadata or {}
        lacking += [f"{path.name}: column {field.name} has no {key.decode()}" for key in COLUMN_KEYS if not found.get(key)]
    return lacking


def count_by_pyarrow(paths, column):
    """Counts the words of a column, file by file."""
    counts = collections.Counter()
    for path in paths:
        counts.update(pq.ParquetFile(path).read([column]).column(column).to_pylist())
    return dict(counts)


def count_by_duckdb(results, column):
    """Counts the words of a column over all shards."""
    runs = str(results / "runs" / "*.parquet")
    return dict(duckdb.execute(f"select {column}::varchar, count(*) from read_parquet(?) group by 1", [runs]).fetchall())


def main():
    results = pathlib.Path(sys.argv[1])
    paths = sorted((results / "runs").glob("shard=*.parquet"))
    if not paths:
        sys.exit(f"{results}/runs: no shard")
    problems = [problem for path in paths for problem in check_metadata(path)]
    rows = sum(pq.read_metadata(path).num_rows for path in paths)
    print(f"{len(paths)} shards, {rows} runs, {len(pq.read_schema(paths[0]))} columns")
    for column in ("status", "agreement"):
        by_pyarrow, by_duckdb = count_by_pyarrow(paths, column), count_by_duckdb(results, column)
        print(column, " ".join(f"{word}={count}" for word, count in sorted(by_duckdb.items())))
        if by_pyarrow != by_duckdb or sum(by_duckdb.values()) != rows:
            problems.append(f"{column}: pyarrow counts {by_pyarrow}, DuckDB {by_duckdb}, rows {rows}")
    if problems:
        sys.exit("\n".join(problems))


if __name__ == "__main__":
    main()
