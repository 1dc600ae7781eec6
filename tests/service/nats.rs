//! NATS: a real server, fed and watched by a client nobody here wrote (`tests/oracles/nats_workers.py`). What a
//! build without it says: `.ci/run`.

use crate::program::strapd;

mod built_with_it {
    use super::*;
    use crate::broker::judged;

    fn beside_a_server(what: &str, said: &str) {
        judged("nats_workers.py", what, said);
    }

    #[test]
    #[cfg_attr(
        not(has_oracles),
        ignore = "needs STRAPD_ORACLES_PYTHON=PYTHON with the packages of benches/peers/requirements.txt"
    )]
    fn lines_and_packed_samples_of_subjects_give_the_bytes_of_tcp() {
        beside_a_server("core", "each byte as over TCP");
    }

    #[test]
    #[cfg_attr(
        not(has_oracles),
        ignore = "needs STRAPD_ORACLES_PYTHON=PYTHON with the packages of benches/peers/requirements.txt"
    )]
    fn bad_senders_wrong_passwords_and_a_server_that_restarts_are_said_and_survived() {
        beside_a_server("faults", "errors said for 200 bad lines");
    }

    #[test]
    #[cfg_attr(
        not(has_oracles),
        ignore = "needs STRAPD_ORACLES_PYTHON=PYTHON with the packages of benches/peers/requirements.txt"
    )]
    fn a_full_stream_costs_no_attitude_and_a_worker_that_stood_still_comes_back() {
        beside_a_server("full", "none missing, none twice");
    }

    /// Fifty of each: minutes (`.ci/full brokers`).
    #[test]
    #[ignore = "long: .ci/full brokers"]
    fn a_worker_that_is_killed_or_stopped_costs_no_attitude_and_no_bit() {
        beside_a_server("handover 50 50", "none missing, none twice");
    }

    #[test]
    fn what_no_server_could_take_is_refused_before_anything_is_bound() {
        let dir = tempfile::tempdir().unwrap();
        for (arguments, word) in [
            ("serve nats://127.0.0.1:4222", "a subject is needed"),
            ("serve nats://h/imu.*?state=B&p=0", "?stream="),
            ("serve -o nats://h/att", "{id}"),
            ("serve nats://h/imu.* nats://h/imu.*", "given twice"),
            (
                "serve nats://h/a.*?stream=S&state=B&p=0 nats://h/b.*?stream=S&state=B&p=1",
                "two partitions",
            ),
        ] {
            strapd(dir.path(), arguments).refused(2, &[word]);
        }
    }
}
