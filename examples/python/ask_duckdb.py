#!/usr/bin/env python3
"""Questions to many attitudes at once, in SQL, by DuckDB: over the files of `many_logs.py`, and over an attitude in memory.

    ask_duckdb.py FOLDER

Needs duckdb and pyarrow.
"""

import sys

import duckdb
import strapd


def main(folder):
    answers = duckdb.sql(
        f"""
        select parse_filename(filename) as log, count(*) as attitudes,
               round((max(t_ns) - min(t_ns)) / 1e9, 3) as seconds,
               round(max(degrees(2 * acos(least(1, sqrt(qw * qw + qz * qz))))), 2) as most_tilted_deg,
               round(degrees(last(sigma_z order by t_ns)), 3) as heading_sigma_deg
        from read_parquet('{folder}/*.parquet', filename = true) group by 1 order by 1
        """
    )
    print(answers)
    # An attitude is a table itself: DuckDB takes it by Arrow.
    made = strapd.simulate("walking", rate_hz=100, duration=10)
    walk = strapd.estimate(made.gyr, made.acc, t=made.t)  # noqa: F841, the question names it
    print(duckdb.sql("select count(*) as attitudes, round(max(sqrt(wx * wx + wy * wy + wz * wz)), 3) as fastest_rad_s from walk"))


if __name__ == "__main__":
    main(sys.argv[1])
