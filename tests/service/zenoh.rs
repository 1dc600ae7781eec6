//! Zenoh: a real router, and a robot and a judge of a library nobody here wrote (`tests/oracles/zenoh_robot.py`); and
//! what a build without it says.

use crate::program::strapd;

#[cfg(not(feature = "zenoh"))]
#[test]
fn a_build_without_the_feature_names_it() {
    let dir = tempfile::tempdir().unwrap();
    for arguments in [
        "serve zenoh://tcp/127.0.0.1:7447/0/**?rmw",
        "serve -o zenoh://tcp/127.0.0.1:7447/0/{id}/attitude?rmw",
    ] {
        let words = ["without the feature zenoh", "--features zenoh"];
        strapd(dir.path(), arguments).refused(2, &words);
    }
}

#[cfg(feature = "zenoh")]
mod built_with_it {
    use super::*;
    use crate::broker::judged;

    #[test]
    #[cfg_attr(
        not(has_oracles),
        ignore = "needs STRAPD_ORACLES_PYTHON=PYTHON with the packages of benches/peers/requirements.txt"
    )]
    fn a_robot_of_ros_2_is_read_and_reads_attitudes() {
        judged("zenoh_robot.py", "rmw", "2000 of 2000 messages back");
    }

    #[test]
    #[cfg_attr(
        not(has_oracles),
        ignore = "needs STRAPD_ORACLES_PYTHON=PYTHON with the packages of benches/peers/requirements.txt"
    )]
    fn lines_and_packed_samples_of_keys_give_the_bytes_of_tcp() {
        judged("zenoh_robot.py", "own", "each byte as over TCP");
    }

    #[test]
    #[cfg_attr(
        not(has_oracles),
        ignore = "needs STRAPD_ORACLES_PYTHON=PYTHON with the packages of benches/peers/requirements.txt"
    )]
    fn bad_messages_wrong_passwords_and_a_router_that_restarts_are_said_and_survived() {
        judged("zenoh_robot.py", "faults", "counted for 206 bad messages");
    }

    /// Measures for 20 s at 10,000 messages a second.
    #[test]
    #[ignore = "long: .ci/full brokers"]
    fn a_robot_is_not_held_up_by_a_reader_that_stands_still() {
        judged("zenoh_robot.py", "slow", "stopped for 10 s");
    }

    #[test]
    fn what_no_router_could_take_is_refused_before_anything_is_bound() {
        let dir = tempfile::tempdir().unwrap();
        for (arguments, word) in [
            ("serve zenoh://tcp/127.0.0.1:7447", "a key is needed"),
            ("serve zenoh://tcp/h/**?rmw", "begins with the domain"),
            ("serve -o zenoh://tcp/h/att", "{id}"),
            (
                "serve zenoh://tcp/h/imu/* zenoh://tcp/h/imu/*",
                "given twice",
            ),
        ] {
            strapd(dir.path(), arguments).refused(2, &[word]);
        }
    }
}
