"""An Attitude as a table of pandas, polars, pyarrow and DuckDB."""

from __future__ import annotations

import pathlib

import numpy as np
import pytest
import strapd
from conftest import same_bits, turning

T, GYR, ACC = turning(500)
ATT = strapd.estimate(GYR, ACC, t=T)
COLUMNS = ["t_ns", "qw", "qx", "qy", "qz", "wx", "wy", "wz", "sigma_x", "sigma_y", "sigma_z", "status", "reset"]


def test_pandas_and_polars_have_the_same_columns_types_and_bits() -> None:
    pandas, polars = pytest.importorskip("pandas"), pytest.importorskip("polars")
    for table in (ATT.to_pandas(), ATT.to_polars()):
        assert isinstance(table, (pandas.DataFrame, polars.DataFrame)) and list(table.columns) == COLUMNS and len(table) == 500
        for name, column in ATT.to_dict().items():
            found = table[name].to_numpy()
            assert found.dtype == column.dtype, name
            same_bits(found.astype(np.float64), np.ascontiguousarray(column).astype(np.float64))


def test_arrow_takes_an_attitude_by_its_protocol() -> None:
    pyarrow = pytest.importorskip("pyarrow")
    table = pyarrow.table(ATT)
    assert table.column_names == COLUMNS and table.num_rows == 500
    same_bits(table["qz"].to_numpy(), np.ascontiguousarray(ATT.q[:, 3]))
    assert table.schema.metadata[b"strapd.world"] == b"level"
    assert pyarrow.schema(ATT) == ATT.to_arrow().schema
    # A part, and none.
    assert pyarrow.table(ATT[:7]).num_rows == 7 and pyarrow.table(ATT[:0]).num_rows == 0
    # What is asked for otherwise is given otherwise.
    narrow = pyarrow.schema([(name, pyarrow.float32() if name.startswith("q") else table.schema.field(name).type) for name in COLUMNS])
    reader = pyarrow.RecordBatchReader.from_stream(ATT, schema=narrow)
    assert reader.read_all()["qw"].type == pyarrow.float32()


def test_polars_pandas_and_duckdb_take_it_too() -> None:
    polars = pytest.importorskip("polars")
    same_bits(polars.DataFrame(ATT)["qw"].to_numpy(), np.ascontiguousarray(ATT.q[:, 0]))
    duckdb = pytest.importorskip("duckdb")
    att = ATT  # noqa: F841, the question names it
    (found,) = duckdb.sql("select max(wx) from att").fetchall()
    assert found[0] == ATT.rate[:, 0].max()


def test_without_pyarrow_polars_speaks_and_without_both_it_says_so(monkeypatch: pytest.MonkeyPatch) -> None:
    import sys

    polars = pytest.importorskip("polars")
    monkeypatch.setitem(sys.modules, "pyarrow", None)
    same_bits(polars.DataFrame(ATT)["qw"].to_numpy(), np.ascontiguousarray(ATT.q[:, 0]))
    monkeypatch.setitem(sys.modules, "polars", None)
    with pytest.raises(ImportError, match="spoken through pyarrow or polars"):
        ATT.__arrow_c_stream__()


def test_a_parquet_file_comes_back_to_the_bit(tmp_path: pathlib.Path) -> None:
    parquet = pytest.importorskip("pyarrow.parquet")
    parquet.write_table(ATT.to_arrow(), tmp_path / "a.parquet")
    back = parquet.read_table(tmp_path / "a.parquet")
    for name, column in ATT.to_dict().items():
        assert (back[name].to_numpy() == column).all(), name
    assert back.schema.metadata[b"strapd.body"] == b"flu"
