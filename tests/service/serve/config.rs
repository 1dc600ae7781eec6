//! Flag before environment before file before default, and each sensor with settings of its own.

use super::client::Client;
use super::daemon::{Process, strapd};
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

fn file(dir: &Path, text: &str) -> PathBuf {
    let path = dir.join("strapd.toml");
    std::fs::write(&path, text).unwrap();
    path
}

fn ask(action: &str, file: &Path, unit: Option<&str>) -> Output {
    let mut command = Command::new(strapd());
    command.args(["config", action]).arg(file);
    match unit {
        Some(unit) => command.env("STRAPD_GYRO_UNIT", unit),
        None => command.env_remove("STRAPD_GYRO_UNIT"),
    };
    command.output().unwrap()
}

#[test]
fn every_value_is_shown_with_where_it_comes_from() {
    let dir = tempfile::tempdir().unwrap();
    let path = file(
        dir.path(),
        "listen = [\"tcp-listen://127.0.0.1:0\"]\ngyro-unit = \"deg\"\nmax-gap = 0.25\nallow-insecure-remote = true\n[sensor.left]\nbody = \"frd\"\n",
    );
    let shown = |unit| {
        let output = ask("show", &path, unit);
        assert!(output.status.success(), "{output:?}");
        let text = String::from_utf8(output.stdout).unwrap();
        // What is shown is itself a configuration.
        let _: toml::Table = text.parse().unwrap();
        let lines: Vec<String> = text
            .lines()
            .map(|l| l.split_whitespace().collect::<Vec<_>>().join(" "))
            .collect();
        lines
    };
    let plain = shown(None);
    for line in [
        "listen = [\"tcp-listen://127.0.0.1:0\"] # file",
        "gyro-unit = \"deg\" # file",
        "max-gap = \"0.25\" # file",
        "allow-insecure-remote = true # file",
        "method = \"commit\" # default",
        "body = \"frd\" # file",
    ] {
        assert!(plain.iter().any(|l| l == line), "no `{line}` in {plain:#?}");
    }
    let line = "gyro-unit = \"mrad\" # environment";
    assert!(shown(Some("mrad")).iter().any(|l| l == line), "{line}");
}

#[test]
fn what_is_wrong_in_a_file_is_named_with_its_place() {
    let dir = tempfile::tempdir().unwrap();
    for (text, complaint) in [
        ("listen = [", "line 1"),
        ("\n\ngyro-unit = deg", "line 3"),
        ("gyro-units = \"deg\"", "unknown key `gyro-units`"),
        ("config = \"other\"", "unknown key `config`"),
        (
            "# mine\n\ngyro_unit = \"deg\"",
            "line 3: unknown key `gyro_unit`\n  help: there is gyro-unit",
        ),
        (
            "[sensor.\"a b\"]\nbody = \"frd\"\nworlds = \"ned\"",
            "line 3: [sensor.a b] unknown key `worlds`\n  help: there is world",
        ),
        (
            "[sensor.a]\nlisten = \"x\"",
            "listen is one for all sensors",
        ),
        (
            "[sensor.a]\n\nbias = 1979-05-27",
            "line 3: [sensor.a] `bias`",
        ),
        ("gyro-unit = \"degrees\"", "degrees"),
        ("gyro-unit = 1979-05-27", "datetime"),
        ("listen = \"ftp://x\"", "known: tcp-listen"),
        (
            "listen = \"tcp-listen://0.0.0.0:0\"",
            "--allow-insecure-remote",
        ),
        ("aid = \"none\"\nbias = \"auto\"", "--bias x,y,z"),
        (
            "record = \"r.mcap\"\nrecord-split = \"bananas\"",
            "--record-split",
        ),
        ("record = \"/nowhere/r.mcap\"", "no folder /nowhere"),
        ("record = \"r.csv\"", "ends in .mcap"),
        ("sensor = 1", "[sensor.ID]"),
        ("[sensor.a]\nlisten = \"x\"", "[sensor.a]"),
        ("[sensor.a]\nworld = \"up\"", "up"),
        ("aid = \"none\"\n[sensor.a]\ninit = \"gravity\"", "sensor a"),
    ] {
        let path = file(dir.path(), text);
        let output = ask("check", &path, None);
        let said = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(2), "{text}: {said}");
        assert!(said.contains(complaint), "{text}: {said}");
    }
    let output = ask("check", &dir.path().join("none.toml"), None);
    assert_eq!(output.status.code(), Some(1), "{output:?}");
    let output = ask("check", &file(dir.path(), ""), None);
    assert_eq!(output.status.code(), Some(0), "{output:?}");
}

#[test]
fn each_sensor_has_its_own_unit_and_a_flag_wins_over_all() {
    let dir = tempfile::tempdir().unwrap();
    let path = file(
        dir.path(),
        "listen = \"tcp-listen://127.0.0.1:0\"\ngyro-unit = \"mrad\"\n[sensor.degrees]\ngyro-unit = \"deg\"\n",
    );
    let rate_of = |flags: &[&str], id: &str| {
        let mut args = vec!["--config", path.to_str().unwrap()];
        args.extend(flags);
        let process = Process::start(&args);
        let mut client = Client::tcp(process.address(0)).watching("{\"class\":\"WATCH\"}");
        client.send(&format!(
            "{{\"id\":\"{id}\",\"stamp\":{{\"sec\":1,\"nsec\":0}},\"gyro\":[9,0,0]}}"
        ));
        client.object("ATT")["rate"][0].as_f64().unwrap()
    };
    assert!((rate_of(&[], "degrees") - 9_f64.to_radians()).abs() < 1e-15);
    assert!((rate_of(&[], "other") - 9e-3).abs() < 1e-15);
    assert!((rate_of(&["--gyro-unit", "rad"], "degrees") - 9.0).abs() < 1e-15);
}
