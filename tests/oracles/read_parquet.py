"""The tables that strapd writes, read by three programs of other people and held against its CSV of the same run.

    python read_parquet.py attitude.parquet attitude.csv

Needs pyarrow, polars, duckdb. Every number of every row has to have the bits of the CSV's; sigmas, which a table keeps
to 24 bits, have to be the CSV's degrees to those.
"""

import csv
import math
import struct
import sys

import duckdb
import polars
import pyarrow.parquet

EXACT = ["qw", "qx", "qy", "qz", "wx", "wy", "wz"]
SIGMA = ["sigma_x", "sigma_y", "sigma_z"]


def bits(value):
    return struct.pack("<d", value)


def by_pyarrow(path):
    file = pyarrow.parquet.ParquetFile(path)
    table = file.read()
    stamps = table["stamp"].cast("int64").to_pylist()
    groups = [file.metadata.row_group(i).num_rows for i in range(file.metadata.num_row_groups)]
    assert sum(groups) == table.num_rows, groups
    # Who asks for a stretch of time reads no more groups than it takes.
    for group in range(len(groups)):
        assert file.metadata.row_group(group).column(0).statistics.has_min_max, group
    return {"stamp": stamps, **{name: table[name].to_pylist() for name in EXACT + SIGMA + ["status", "reset", "id"]}}


def by_polars(path):
    table = polars.read_parquet(path)
    stamps = table["stamp"].cast(polars.Int64).to_list()
    return {"stamp": stamps, **{name: table[name].to_list() for name in EXACT + SIGMA + ["status", "reset", "id"]}}


def by_duckdb(path):
    names = EXACT + SIGMA + ["status", "reset", "id"]
    # A plain number stays one.
    kind = duckdb.sql(f"select typeof(stamp) from '{path}' limit 1").fetchall()
    stamp = "stamp" if kind == [("BIGINT",)] else "epoch_ns(stamp)"
    rows = duckdb.sql(f"select {stamp}, {', '.join(names)} from '{path}'").fetchall()
    return dict(zip(["stamp", *names], map(list, zip(*rows))))


def main(path, text):
    with open(text, newline="") as file:
        rows = list(csv.DictReader(file))
    said = pyarrow.parquet.read_metadata(path).metadata
    bit_of = dict(pair.split("=")[::-1] for pair in said[b"strapd.status"].decode().split())
    for read in [by_pyarrow, by_polars, by_duckdb]:
        table = read(path)
        assert len(table["stamp"]) == len(rows), (read.__name__, len(table["stamp"]), len(rows))
        for i, row in enumerate(rows):
            assert table["stamp"][i] == int(row["stamp_ns"]), (read.__name__, i)
            for name in EXACT:
                assert bits(table[name][i]) == bits(float(row[name])), (read.__name__, name, i)
            for name in SIGMA:
                want = math.radians(float(row[name + "_deg"]))
                got = table[name][i]
                # Half a step of 24 bits.
                assert got == want or abs(got - want) <= 6e-8 * want, (read.__name__, name, i, got, want)
            names = [] if row["status"] == "ok" else row["status"].split("|")
            assert table["status"][i] == sum(int(bit_of[name]) for name in names), (read.__name__, i)
        print(f"{read.__name__}: {len(rows)} rows alike")
    print("world", said[b"strapd.world"].decode(), "version", said[b"strapd.version"].decode())


main(*sys.argv[1:])
