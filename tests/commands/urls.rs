//! Addresses as inputs: the bits of the file, whatever the server does. What a build without
//! the feature says: `.ci/run`.

use crate::program::strapd;
use std::path::{Path, PathBuf};

fn fixture(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("fixtures")
        .join(name)
}

mod faults;
mod patterns;
mod secrets;
mod server;
mod sparse;
mod uploads;

mod built_with_it {
    use super::server::{Manner, Server};
    use super::*;
    use crate::shared_data::shared;

    /// The same attitudes and exit code, and as many bytes as there are at most.
    fn assert_same(log: &Path, flags: &str) {
        let dir = tempfile::tempdir().unwrap();
        let name = log.file_name().unwrap().to_str().unwrap();
        let file = strapd(
            dir.path(),
            &format!("replay {} {flags} -o a.csv", log.display()),
        );
        for manner in [Manner::Good, Manner::NoRanges] {
            let server = Server::file(manner.clone(), log);
            let there = strapd(
                dir.path(),
                &format!("replay {} {flags} -o b.csv --force", server.url(name)),
            );
            assert_eq!(there.code, file.code, "{name} {manner:?}: {there:?}");
            let read = |name: &str| std::fs::read(dir.path().join(name)).ok();
            assert_eq!(read("a.csv"), read("b.csv"), "{name} {manner:?}");
            assert!(read("a.csv").is_some(), "{name}: {file:?}");
            let size = std::fs::metadata(log).unwrap().len() as usize;
            assert!(server.sent() <= size, "{name}: {} of {size}", server.sent());
        }
    }

    #[test]
    fn every_format_gives_the_bits_of_its_file() {
        let dir = tempfile::tempdir().unwrap();
        let log = fixture("xsens_mti.mcap");
        for (form, name) in [("ndjson", "a.ndjson"), ("csv", "a.csv")] {
            let text = strapd(
                dir.path(),
                &format!("cat {} --format {form}", log.display()),
            );
            std::fs::write(dir.path().join(name), text.done().out.as_bytes()).unwrap();
            assert_same(&dir.path().join(name), "");
        }
        for (name, flags) in [
            ("xsens_mti.mcap", ""),
            ("px4_flight.ulg", ""),
            ("constant_rate_bz2.bag", ""),
            ("constant_rate_lz4.bag", ""),
            ("constant_rate.db3", ""),
            ("gopro_hero6.raw", ""),
            ("ardupilot.tlog", "--topic SCALED_IMU2"),
        ] {
            assert_same(&fixture(name), flags);
        }
    }

    #[test]
    #[cfg_attr(not(has_shared), ignore = "needs ../shared (optional recordings)")]
    fn real_and_broken_recordings_give_the_bits_of_their_files() {
        for log in [
            "real/broad07_60s_ros2_zstd.mcap",
            "real/husky_ros1_lz4.mcap",
            "real/px4_fmuv6c_json_zstd.mcap",
            "real/xio_fusion_ros2_lz4.mcap",
            "real/xsens_mti_ros2_none.mcap",
            "hostile/01_no_summary.mcap",
            "hostile/02_truncated_mid_chunk.mcap",
        ] {
            assert_same(&shared(&format!("logs/{log}")).unwrap(), "");
        }
    }

    #[test]
    fn every_command_that_takes_a_file_takes_an_address() {
        let dir = tempfile::tempdir().unwrap();
        let log = fixture("xsens_mti.mcap");
        let server = Server::file(Manner::Good, &log);
        let there = server.url("d/xsens_mti.mcap");
        let log = log.display().to_string();
        for command in [
            "info {}",
            "info {} --json",
            "check {}",
            "check {} --json",
            "cat {} -n 100",
            "allan {} --json",
            "compare {} {}",
            "report {} --json",
            "replay {} -o null: --json",
        ] {
            let of = |name: &str| {
                let ran = strapd(dir.path(), &command.replace("{}", name));
                let elapsed = |line: &&str| !line.contains("elapsed");
                let out: Vec<String> = ran
                    .out
                    .replace(name, "NAME")
                    // Its own command, where a file is kept by its name.
                    .replace("report xsens_mti.mcap", "report NAME")
                    .lines()
                    .filter(elapsed)
                    .map(str::to_owned)
                    .collect();
                (ran.code, out)
            };
            let (file, there) = (of(&log), of(&there));
            assert_eq!(file.0, there.0, "{command}");
            if command != "replay {} -o null: --json" {
                assert_eq!(file.1, there.1, "{command}");
            }
        }
        let ran = strapd(dir.path(), &format!("report {there} -o page.html"));
        ran.done();
        // Several, and one that is not there.
        std::fs::create_dir(dir.path().join("out")).unwrap();
        let missing = Server::of(Manner::Refuse(404), Vec::new());
        let ran = strapd(
            dir.path(),
            &format!(
                "replay {there} {} -o out/{{stem}}.csv",
                missing.url("no.mcap")
            ),
        );
        assert_eq!(ran.code, Some(1), "{ran:?}");
        assert!(ran.err.contains("404 Not Found"), "{}", ran.err);
        assert!(dir.path().join("out/xsens_mti.csv").is_file());
    }

    #[test]
    fn what_can_not_be_done_with_an_address_is_said() {
        let dir = tempfile::tempdir().unwrap();
        let server = Server::file(Manner::Good, &fixture("xsens_mti.mcap"));
        let there = server.url("a.mcap");
        strapd(dir.path(), &format!("recover {there} -o x.mcap"))
            .refused(2, &["what is recovered is a file", "save it to one"]);
        strapd(
            dir.path(),
            &format!("replay --join {there} {there} -o x.mcap"),
        )
        .refused(1, &["is elsewhere", "save it to a file"]);
        let output = "replay s3.mcap -o https://h/x.mcap?sig=s3cret";
        let ran = strapd(dir.path(), output);
        ran.refused(2, &["https://h/x.mcap", "curl -T"]);
        assert!(!ran.err.contains("s3cret"), "{}", ran.err);
        assert_eq!(std::fs::read_dir(dir.path()).unwrap().count(), 0);
        let empty = Server::of(Manner::Good, Vec::new());
        strapd(dir.path(), &format!("info {}", empty.url("a.mcap")))
            .refused(1, &["the file is empty"]);
    }
}
