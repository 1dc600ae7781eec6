"""Tables in Parquet by somebody else's programs, of samples whose numbers need no program to be known:

    python tests/oracles/parquet_tables.py FOLDER [ROWS]     (needs: pip install pyarrow polars duckdb)

`fuzz/seeds/parquet` is what it writes with 60 rows; `tests/commands/parquet_in.rs` reads that, and these of any length.
"""

import sys
from pathlib import Path

import duckdb
import polars
import pyarrow as pa
import pyarrow.parquet as pq

at = Path(sys.argv[1])
rows = int(sys.argv[2]) if len(sys.argv) > 2 else 60
at.mkdir(parents=True, exist_ok=True)

stamps = [1_700_000_000_000_000_000 + n * 5_000_000 + (n * 7919 % 1000) * 1000 for n in range(rows)]


def number(column, n):
    """A fraction of a power of two, the same in any program; of single precision, too."""
    return ((n * 7919 + column * 104729) % 2001 - 1000) / 4096 + (9 if column == 5 else 0)


def table(stamp, single=False, without=()):
    kind = pa.float32() if single else pa.float64()
    columns = {"stamp": stamp}
    for place, name in enumerate(["gyro_x", "gyro_y", "gyro_z", "accel_x", "accel_y", "accel_z"]):
        absent = [n in without and place >= 3 for n in range(rows)]
        values = [None if gone else number(place, n) for n, gone in enumerate(absent)]
        columns[name] = pa.array(values, kind)
    columns["label"] = pa.array(["a", "bb"] * (rows // 2))
    columns["list"] = pa.array([[1.0, 2.0]] * rows)
    return pa.table(columns)


def write(name, of, **options):
    pq.write_table(of, at / f"{name}.parquet", **options)


nanos = table(pa.array(stamps, pa.timestamp("ns", "UTC")))
small = {"row_group_size": rows // 3 + 1, "data_page_size": 128, "write_batch_size": 16}
for codec in ["none", "snappy", "gzip", "zstd", "lz4"]:
    for version in ["1.0", "2.0"]:
        write(f"arrow_{codec}_{version[0]}", nanos, compression=codec, data_page_version=version, **small)
write("arrow_checksums", nanos, write_page_checksum=True, **small)
write("arrow_plain", nanos, use_dictionary=False, compression="none", **small)
floats = [f"{kind}_{axis}" for kind in ("gyro", "accel") for axis in "xyz"]
split = {"column_encoding": {**{name: "BYTE_STREAM_SPLIT" for name in floats}, "stamp": "DELTA_BINARY_PACKED"}}
write("arrow_split", nanos, use_dictionary=False, **split, **small)
write("arrow_days", nanos, use_deprecated_int96_timestamps=True)
write("arrow_micros", table(pa.array([n // 1000 for n in stamps], pa.timestamp("us"))))
write("arrow_single", table(pa.array(stamps, pa.timestamp("ns")), single=True))
whole = table(pa.array(stamps)).rename_columns(["stamp_ns", *nanos.column_names[1:]])
write("arrow_whole", whole)
parts = [
    pa.StructArray.from_arrays([nanos[f"{kind}_{axis}"].combine_chunks() for axis in "xyz"], names=list("xyz"))
    for kind in ("gyro", "accel")
]
index = {"__index_level_0__": nanos["stamp"], "gyro": parts[0], "accel": parts[1]}
write("arrow_nested", pa.table(index))
for version in ["1.0", "2.0"]:
    gaps = table(nanos["stamp"], without={n for n in range(rows) if n % 10 == 3})
    write(f"nulls_{version[0]}", gaps, data_page_version=version, **small)
polars.from_arrow(nanos).write_parquet(at / "polars.parquet")
duckdb.sql(f"copy nanos to '{at / 'duckdb.parquet'}' (format parquet)")
duckdb.sql(f"copy nanos to '{at / 'duckdb_2.parquet'}' (format parquet, parquet_version v2, compression zstd)")
