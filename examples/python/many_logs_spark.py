#!/usr/bin/env python3
"""A folder of logs -> one table of attitudes in Parquet, by Spark: names in, rows out (`mapInPandas`).

    many_logs_spark.py FOLDER OUT

Needs pyspark, pandas, pyarrow and a Java of 17 or newer. The attitudes are rows of Spark's from there on: to be joined, counted,
written. Who wants files alone takes `one_log.replayed` in `foreachPartition`, and no rows go through Java.
"""

import os
import pathlib
import sys

import strapd
from pyspark.sql import SparkSession

COLUMNS = "log string, t_ns long, qw double, qx double, qy double, qz double, sigma_x double, sigma_y double, sigma_z double, status int"


def attitudes(tables):
    """Tables with a column of names -> tables of attitudes."""
    for table in tables:
        for log in table["log"]:
            found = strapd.replay(log, threads=1).to_pandas()
            found.insert(0, "log", pathlib.Path(log).stem)
            yield found[[word.split()[0] for word in COLUMNS.split(", ")]]


def main(folder, out):
    logs = sorted(str(path.resolve()) for path in pathlib.Path(folder).glob("*.mcap"))
    if not logs:
        sys.exit(f"{folder}: no logs")
    # Its workers are to be this Python, and not the first on PATH.
    os.environ.setdefault("PYSPARK_PYTHON", sys.executable)
    spark = SparkSession.builder.master("local[2]").appName("strapd").config("spark.ui.enabled", "false").getOrCreate()
    spark.sparkContext.setLogLevel("ERROR")
    # A partition a task, a few logs a partition.
    names = spark.createDataFrame([(log,) for log in logs], "log string").repartition(min(len(logs), 8))
    names.mapInPandas(attitudes, COLUMNS).write.mode("overwrite").parquet(str(out))
    counted = spark.read.parquet(str(out)).groupBy("log").count().collect()
    print(f"{len(counted)} logs, {sum(row['count'] for row in counted)} attitudes")
    spark.stop()


if __name__ == "__main__":
    main(*sys.argv[1:3])
