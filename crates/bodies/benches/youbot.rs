//! The youBot's arm, native and without allocation: nanoseconds of each kernel over a thousand random
//! poses between the stops.
//!
//! `cargo bench --bench youbot`, or, for instructions instead of nanoseconds,
//! `valgrind --tool=callgrind --toggle-collect='*kernel_inverse*' <bench binary> --once`.
#![allow(missing_docs, clippy::unwrap_used)]

use criterion::{Criterion, Throughput, criterion_group};
use nalgebra::Vector3;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::hint::black_box;
use strapd_attitude::frames::In;
use strapd_bodies::dh::Transform;
use strapd_bodies::youbot::*;

const POSES: usize = 1000;

struct Work {
    arm: Arm,
    dynamics: Dynamics,
    motions: Vec<TableMotion>,
    targets: Vec<Transform<Base, Tool>>,
}

fn work() -> Work {
    let arm = Arm::urdf();
    let g_b = In::assume(Vector3::new(0.0, 0.0, -9.81));
    let dynamics = Dynamics::new(arm, published_links(&arm).unwrap(), g_b).unwrap();
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    let (min, max) = (arm.limits().min(), arm.limits().max());
    let motions: Vec<TableMotion> = (0..POSES)
        .map(|_| {
            let q = std::array::from_fn(|i| rng.random_range(min[i]..max[i]));
            let mut five = || std::array::from_fn(|_| rng.random_range(-1.5..1.5));
            TableMotion::new(TableJoints::new(q).unwrap(), five(), five()).unwrap()
        })
        .collect();
    let targets = motions.iter().map(|m| arm.forward(m.q())).collect();
    Work {
        arm,
        dynamics,
        motions,
        targets,
    }
}

// Out of line and by name, so that callgrind can tell them apart.
#[inline(never)]
fn kernel_forward(w: &Work) -> f64 {
    let poses = w.motions.iter().map(|m| w.arm.forward(black_box(m.q())));
    poses.map(|t| t.translation().as_vector().z).sum()
}
#[inline(never)]
fn kernel_inverse(w: &Work) -> usize {
    let ask = |t| w.arm.inverse(black_box(t), Policy::default(), None);
    w.targets
        .iter()
        .map(|t| ask(t).unwrap().as_slice().len())
        .sum()
}
#[inline(never)]
fn kernel_jacobian(w: &Work) -> f64 {
    w.motions
        .iter()
        .map(|m| w.arm.jacobian(black_box(m.q()))[(0, 1)])
        .sum()
}
#[inline(never)]
fn kernel_newton_euler(w: &Work) -> f64 {
    w.motions
        .iter()
        .map(|m| w.dynamics.torques(black_box(m)).0[1])
        .sum()
}
#[inline(never)]
fn kernel_mass_matrix(w: &Work) -> f64 {
    w.motions
        .iter()
        .map(|m| w.dynamics.mass_matrix(black_box(m.q()))[(0, 0)])
        .sum()
}
#[inline(never)]
fn kernel_imu(w: &Work) -> f64 {
    let g_b = In::assume(Vector3::new(0.0, 0.0, -9.81));
    let mount = ImuMount::at_tool();
    w.motions
        .iter()
        .map(|m| mount.read(&w.arm, black_box(m), &g_b).rate.0.x)
        .sum()
}

fn kernels(c: &mut Criterion) {
    let w = work();
    let mut group = c.benchmark_group("youbot");
    group.throughput(Throughput::Elements(POSES as u64));
    group.bench_function("forward", |b| b.iter(|| kernel_forward(&w)));
    group.bench_function("inverse, every branch", |b| b.iter(|| kernel_inverse(&w)));
    group.bench_function("jacobian", |b| b.iter(|| kernel_jacobian(&w)));
    group.bench_function("newton-euler", |b| b.iter(|| kernel_newton_euler(&w)));
    group.bench_function("mass matrix", |b| b.iter(|| kernel_mass_matrix(&w)));
    group.bench_function("imu", |b| b.iter(|| kernel_imu(&w)));
    group.finish();
}

criterion_group!(benches, kernels);

fn main() {
    if std::env::args().any(|a| a == "--once") {
        let w = work();
        let sums = kernel_forward(&w) + kernel_jacobian(&w) + kernel_newton_euler(&w);
        black_box((
            sums,
            kernel_inverse(&w),
            kernel_mass_matrix(&w),
            kernel_imu(&w),
        ));
        return;
    }
    benches();
    Criterion::default().configure_from_args().final_summary();
}
