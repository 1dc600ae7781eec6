//! The bridge to MQTT that `docs/scale.md` tells of, with the programs of mosquitto (`tests/oracles/mqtt_bridge.py`).

use std::path::Path;
use std::process::Command;

#[test]
#[ignore = "of .ci/full brokers: mosquitto and its clients"]
fn the_documented_bridge_gives_the_bytes_of_tcp() {
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/oracles/mqtt_bridge.py");
    let output = Command::new("python3")
        .arg(&script)
        .arg(assert_cmd::cargo::cargo_bin("strapd"))
        .output()
        .unwrap();
    let text = String::from_utf8_lossy(&output.stdout).into_owned()
        + &String::from_utf8_lossy(&output.stderr);
    assert!(
        output.status.success() && text.contains("each byte as over TCP"),
        "{text}"
    );
    println!("{text}");
}
