//! Draws the computed pictures of `docs/youbot.md` into `docs/pictures`: `cargo run --example youbot_pictures`.
//!
//! - `youbot-workspace.svg`: where the tool point can be, from the side, and three poses of the arm;
//! - `youbot-path.svg`: joints of the simulator's own motion.

// An example stops with the reason when it cannot draw.
#![allow(clippy::unwrap_used, clippy::print_stdout)]

use std::path::Path;
use strapd::report::plot::{Axis, Chart, Series, SeriesStyle};
use strapd_bodies::youbot::{Arm, JointPath, TableJoints};

fn main() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/pictures");
    for (name, chart) in [("youbot-workspace", workspace()), ("youbot-path", path())] {
        let svg = chart.svg().unwrap();
        println!("{name}.svg  {} bytes", svg.len());
        std::fs::write(folder.join(format!("{name}.svg")), svg).unwrap();
    }
}

/// Shoulder, elbow, wrist and tool point in the plane of the arm: radial, up; m.
fn skeleton(arm: &Arm, q: [f64; 5]) -> Vec<[f64; 2]> {
    let q = TableJoints::from_degrees(q).unwrap();
    let poses = arm.link_poses(&q);
    let mut points = vec![[0.0, 0.0], [0.0, arm.parameters().d1]];
    // Link 4 ends in the wrist, where link 3 does.
    for i in [0, 1, 2, 4] {
        let r = poses[i].translation();
        points.push([r.as_vector().x, r.as_vector().z]);
    }
    points
}

/// The tool point for joint 1 at zero, its other joints anywhere between their stops: the outline of
/// what a fine grid of angles reaches, drawn as the grid's points.
fn workspace() -> Chart {
    let arm = Arm::published();
    let (min, max) = (arm.limits().min(), arm.limits().max());
    let grid = |joint: usize, steps: u32| {
        let (lo, hi) = (min[joint], max[joint]);
        (0..=steps).map(move |i| lo + (hi - lo) * f64::from(i) / f64::from(steps))
    };
    // One point for each square of 4 mm: the picture stays small.
    let square = 0.004;
    let mut reached = std::collections::BTreeSet::new();
    for q2 in grid(1, 120) {
        for q3 in grid(2, 180) {
            for q4 in grid(3, 120) {
                let q = TableJoints::new([0.0, q2, q3, q4, 0.0]).unwrap();
                let t = arm.forward(&q).translation();
                let p = t.as_vector();
                reached.insert(((p.x / square).round() as i32, (p.z / square).round() as i32));
            }
        }
    }
    // Only the edge: squares with a neighbour that is not reached.
    let inside = |&(x, z): &(i32, i32)| {
        let around = [(1, 0), (-1, 0), (0, 1), (0, -1)];
        around
            .iter()
            .all(|(dx, dz)| reached.contains(&(x + dx, z + dz)))
    };
    let edge = reached.iter().filter(|s| !inside(s));
    let edge: Vec<[f64; 2]> = edge
        .map(|(x, z)| [f64::from(*x) * square, f64::from(*z) * square])
        .collect();
    let pose = |name: &str, q, color| Series {
        name: name.to_owned(),
        points: skeleton(&arm, q),
        look: SeriesStyle::Marked,
        color: Some(color),
    };
    Chart {
        title: "Reach of the tool point, joint 1 at zero (preset seed)".to_owned(),
        x: Axis::linear("forward, m"),
        y: Axis::linear("up from the mounting plane, m"),
        series: vec![
            Series {
                name: "edge of the reach".to_owned(),
                points: edge,
                look: SeriesStyle::Dots,
                color: Some(5),
            },
            pose("upright: q = 0, 0, 0, 90, 0", [0.0, 0.0, 0.0, 90.0, 0.0], 0),
            pose(
                "gripper down, below the plane",
                [0.0, -65.0, -75.0, 50.0, 0.0],
                2,
            ),
            pose("folded: driver zero", [0.0, 65.0, -146.0, 192.5, 0.0], 3),
        ],
        equal: true,
        size: (860, 760),
        ..Chart::default()
    }
}

/// Joints of the demonstration over time.
fn path() -> Chart {
    let path = JointPath::demonstration();
    let joint = |joint: usize| Series {
        name: format!("q{}", joint + 1),
        points: (0..=400)
            .map(|i| {
                let secs = 0.05 * f64::from(i);
                [
                    secs,
                    path.at(secs).unwrap().q().angles()[joint].to_degrees(),
                ]
            })
            .collect(),
        ..Series::default()
    };
    Chart {
        title: "strapd simulate youbot: every joint swings".to_owned(),
        x: Axis::linear("time, s"),
        y: Axis::linear("joint angle, degrees"),
        series: (0..5).map(joint).collect(),
        ..Chart::default()
    }
}
