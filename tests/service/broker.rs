//! The scripts that play broker, sender and judge for a daemon: `tests/oracles/{nats_workers,zenoh_robot}.py`.

use std::path::Path;
use std::process::Command;

/// Runs `what` of a script, which is to succeed and to have `said` this. `STRAPD_ORACLES_PYTHON` names a Python with
/// the packages of `benches/peers/requirements.txt`.
pub(crate) fn judged(script: &str, what: &str, said: &str) {
    let python = std::env::var_os("STRAPD_ORACLES_PYTHON").expect("it is not set");
    let script = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("tests/oracles")
        .join(script);
    let output = Command::new(&python)
        .arg(&script)
        .arg(assert_cmd::cargo::cargo_bin("strapd"))
        .args(what.split(' '))
        .output()
        .unwrap();
    let text = String::from_utf8_lossy(&output.stdout).into_owned()
        + &String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success() && text.contains(said), "{text}");
    println!("{text}");
}
