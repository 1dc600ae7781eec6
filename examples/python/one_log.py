"""A log -> a Parquet file of its attitude, whole or not at all: what every recipe for many logs calls.

Importable, so that processes that are spawned, and those of Dask, Ray and Spark, find it.
"""

import os
import pathlib

import strapd


def output_of(log, folder):
    """Where the attitude of a log goes."""
    return pathlib.Path(folder) / (pathlib.Path(log).stem + ".parquet")


def replayed(log, folder, again=False, **flags):
    """Replays a log; gives its name, the number of its attitudes and of lost samples, or why there are none.

    What is there already is left as it is, unless `again`: after a crash the same call does what is missing. It is written under
    another name and renamed: whoever looks sees the whole file or none, and a worker that is killed leaves nothing that counts. The
    other name is the log's own, so that the next try writes over it.
    """
    import pyarrow.parquet as parquet

    out = output_of(log, folder)
    if out.exists() and not again:
        return str(log), parquet.read_metadata(out).num_rows, None, "was there"
    partial = out.with_name(f".{out.name}.partial")
    try:
        # Its own threads would only be in each other's way: there is a process for each core.
        att = strapd.replay(log, threads=1, **flags)
        parquet.write_table(att.to_arrow(), partial, compression="zstd")
        os.replace(partial, out)
    except strapd.Error as why:
        # One log that cannot be read is no reason to leave the others.
        return str(log), 0, None, str(why)
    return str(log), len(att), att.lost, ""
