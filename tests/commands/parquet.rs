//! `-o NAME.parquet`: a table that other people's programs read, with the bits of the CSV. What a build
//! without it says: `.ci/run`.

use crate::program::strapd;
use std::path::Path;

fn fixture(name: &str) -> String {
    let path = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("fixtures")
        .join(name);
    path.display().to_string()
}

mod built_with_it {
    use super::*;
    use std::process::Command;

    /// `STRAPD_ORACLES_PYTHON` names a Python with the packages that `read_parquet.py` lists.
    fn read_by_others(dir: &Path, log: &str, said: &str) {
        let ran = strapd(dir, &format!("replay {log} -o t.parquet -o t.csv --force"));
        assert_eq!(ran.code, Some(0), "{ran:?}");
        let python = std::env::var_os("STRAPD_ORACLES_PYTHON").expect("it is not set");
        let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/oracles/read_parquet.py");
        let output = Command::new(&python)
            .current_dir(dir)
            .arg(&script)
            .args(["t.parquet", "t.csv"])
            .output()
            .unwrap();
        let text = String::from_utf8_lossy(&output.stdout).into_owned()
            + &String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success(), "{log}: {text}");
        for reader in ["by_pyarrow", "by_polars", "by_duckdb"] {
            assert!(text.contains(&format!("{reader}: {said}")), "{text}");
        }
    }

    #[test]
    #[cfg_attr(
        not(has_oracles),
        ignore = "needs STRAPD_ORACLES_PYTHON=PYTHON with the packages of benches/peers/requirements.txt"
    )]
    fn pyarrow_polars_and_duckdb_read_the_bits_of_the_csv() {
        let dir = tempfile::tempdir().unwrap();
        // Of a clock of this century, and of one that began when a board was switched on.
        let xsens = fixture("xsens_mti.mcap");
        read_by_others(dir.path(), &xsens, "953 rows alike");
        let gopro = fixture("gopro_hero6.raw") + " --sample-kind average";
        read_by_others(dir.path(), &gopro, "");
        // More than a group of rows.
        strapd(
            dir.path(),
            "simulate coning --rate-hz 10000 --duration 27 -o long.mcap -q",
        )
        .done();
        read_by_others(dir.path(), "long.mcap", "270001 rows alike");
    }

    #[test]
    fn the_bytes_do_not_depend_on_the_number_of_threads() {
        let dir = tempfile::tempdir().unwrap();
        let log = fixture("coning.mcap");
        let bytes = |threads: u32| {
            let made = format!("replay {log} -o t.parquet --force -q --threads {threads}");
            strapd(dir.path(), &made).done();
            let bytes = std::fs::read(dir.path().join("t.parquet")).unwrap();
            // The command itself is kept in the table.
            let said = format!("--threads {threads}");
            let at = bytes.windows(said.len()).position(|w| w == said.as_bytes());
            let mut bytes = bytes;
            bytes[at.unwrap() + said.len() - 1] = b'N';
            bytes
        };
        assert_eq!(bytes(1), bytes(4));
    }

    #[test]
    fn a_table_is_whole_or_not_there() {
        let dir = tempfile::tempdir().unwrap();
        let log = fixture("xsens_mti.mcap");
        let made = format!("replay {log} -o t.parquet -q");
        strapd(dir.path(), &made).done();
        let bytes = std::fs::read(dir.path().join("t.parquet")).unwrap();
        assert_eq!(
            (&bytes[..4], &bytes[bytes.len() - 4..]),
            (&b"PAR1"[..], &b"PAR1"[..])
        );
        strapd(dir.path(), &made).refused(1, &["t.parquet: already exists"]);
        // A log that breaks the run off leaves nothing.
        std::fs::remove_file(dir.path().join("t.parquet")).unwrap();
        std::fs::write(dir.path().join("bad.mcap"), b"nothing").unwrap();
        let ran = strapd(dir.path(), "replay bad.mcap -o t.parquet");
        assert_eq!(ran.code, Some(1), "{ran:?}");
        assert!(!dir.path().join("t.parquet").exists());
    }

    #[test]
    fn single_precision_halves_the_table_and_a_simulation_has_its_samples_in_it() {
        let dir = tempfile::tempdir().unwrap();
        let log = fixture("coning.mcap");
        strapd(dir.path(), &format!("replay {log} -o full.parquet -q")).done();
        strapd(
            dir.path(),
            &format!("replay {log} -o half.parquet -q --parquet-f32"),
        )
        .done();
        let size = |name: &str| std::fs::metadata(dir.path().join(name)).unwrap().len();
        // Of both some 9 kB say what is in it.
        let (half, full) = (size("half.parquet"), size("full.parquet"));
        assert!(4 * half < 3 * full, "{half} {full}");
        strapd(dir.path(), "simulate coning --duration 2 -o raw.parquet -q").done();
        assert!(size("raw.parquet") > 1000);
    }
}
