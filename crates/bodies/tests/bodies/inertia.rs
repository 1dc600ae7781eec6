//! Inertia against particle clouds computed elsewhere (`golden/inertia_golden.json`), the seed
//! document's example, and the document's errors, each refuted by name.
// Prints what it measured, for `--nocapture`.

#[allow(unreachable_pub)]
use nalgebra::{Matrix3, Matrix4, Matrix6, Vector3, Vector6};
use serde_json::Value;
use strapd_attitude::quaternion::Quaternion;
use strapd_bodies::inertia::*;
use strapd_bodies::rigid_body::{Pose, Vessel};

fn golden() -> Option<Value> {
    let path = crate::shared_data::shared("golden/inertia_golden.json")?;
    Some(serde_json::from_slice(&std::fs::read(path).unwrap()).unwrap())
}

fn numbers(v: &Value) -> Vec<f64> {
    match v {
        Value::Array(items) => items.iter().flat_map(numbers).collect(),
        number => vec![number.as_f64().unwrap()],
    }
}
fn vector3(v: &Value) -> Vector3<f64> {
    Vector3::from_row_slice(&numbers(v))
}
fn vector6(v: &Value) -> Vector6<f64> {
    Vector6::from_row_slice(&numbers(v))
}
fn matrix3(v: &Value) -> Matrix3<f64> {
    Matrix3::from_row_slice(&numbers(v))
}
fn matrix6(v: &Value) -> Matrix6<f64> {
    Matrix6::from_row_slice(&numbers(v))
}
fn body(v: &Value) -> RigidBody {
    RigidBody::new(
        v["m"].as_f64().unwrap(),
        vector3(&v["r_g"]),
        matrix3(&v["I_G"]),
    )
    .unwrap()
}

/// The golden file's own tolerance: relative to the largest entry of what is compared.
/// Its numbers come from clouds of particles and carry a few hundred roundings.
#[track_caller]
fn close(what: &str, ours: &[f64], theirs: &[f64], relative: f64) {
    assert_eq!(ours.len(), theirs.len(), "{what}");
    let scale = theirs.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
    for (i, (a, b)) in ours.iter().zip(theirs).enumerate() {
        assert!(
            (a - b).abs() <= relative * scale,
            "{what}[{i}]: {a} against {b}, {:e} of the largest entry",
            (a - b).abs() / scale
        );
    }
}
/// Row-major entries.
fn rows6(m: &Matrix6<f64>) -> Vec<f64> {
    m.transpose().as_slice().to_vec()
}

#[test]
#[cfg_attr(not(has_shared), ignore = "needs ../shared (optional recordings)")]
fn every_golden_body_agrees_in_every_quantity() {
    let Some(golden) = golden() else { return };
    let bodies = golden["bodies"].as_array().unwrap();
    assert_eq!(bodies.len(), 50);
    for (i, g) in bodies.iter().enumerate() {
        let b = body(g);
        let (nu, tau) = (vector6(&g["nu"]), vector6(&g["tau"]));
        let check = |key: &str, ours: &[f64], tolerance: f64| {
            close(
                &format!("body {i} {key}"),
                ours,
                &numbers(&g[key]),
                tolerance,
            );
        };
        check("M_CG", &rows6(&b.mass_matrix_cg()), 1e-12);
        check("M_CO", &rows6(&b.mass_matrix()), 1e-12);
        check("C_nu", b.coriolis(&nu).as_slice(), 1e-12);
        check("C_nu_particles", b.coriolis(&nu).as_slice(), 1e-12);
        for (key, form) in [
            ("C_m2c", CoriolisForm::FromMassMatrix),
            ("C_linvel_free", CoriolisForm::LinearVelocityFree),
        ] {
            check(key, &rows6(&b.coriolis_matrix(form, &nu)), 1e-12);
        }
        check("kinetic", &[b.kinetic_energy(&nu)], 1e-12);
        check("momentum", b.momentum(&nu).as_slice(), 1e-12);
        check(
            "nu_dot",
            b.acceleration(&nu, &tau).unwrap().as_slice(),
            1e-12,
        );
        check("principal", &b.principal_moments(), 1e-12);
        check("pseudo_inertia_CO", b.pseudo_inertia().as_slice(), 1e-12);

        let added = AddedMass::new(matrix6(&g["M_A"])).unwrap();
        check("C_A_nu", added.coriolis(&nu).as_slice(), 1e-12);
        // A 6x6 solve loses the condition number, up to 1e2 here: the file's own 1e-10.
        check(
            "nu_dot_with_added_mass",
            added.acceleration(&b, &nu, &tau).unwrap().as_slice(),
            1e-10,
        );
    }
}

#[test]
#[cfg_attr(not(has_shared), ignore = "needs ../shared (optional recordings)")]
fn all_three_coriolis_matrices_are_skew_and_have_the_same_product() {
    let Some(golden) = golden() else { return };
    for g in golden["bodies"].as_array().unwrap() {
        let (b, nu) = (body(g), vector6(&g["nu"]));
        for form in [
            CoriolisForm::FromMassMatrix,
            CoriolisForm::LinearVelocityFree,
            CoriolisForm::FromCentreOfGravity,
        ] {
            let c = b.coriolis_matrix(form, &nu);
            let scale = c.amax();
            // A handful of roundings of entries of that size.
            assert!((c + c.transpose()).amax() <= 1e-14 * scale, "{form:?}");
            let difference = (c * nu - b.coriolis(&nu)).amax();
            assert!(
                difference <= 1e-14 * scale * nu.amax(),
                "{form:?} {difference:e}"
            );
        }
    }
}

#[test]
#[cfg_attr(not(has_shared), ignore = "needs ../shared (optional recordings)")]
fn a_mass_matrix_comes_apart_into_the_body_it_was_made_of() {
    let Some(golden) = golden() else { return };
    for g in golden["bodies"].as_array().unwrap() {
        let b = body(g);
        let apart = RigidBody::from_mass_matrix(&b.mass_matrix()).unwrap();
        // The body says itself how many digits the subtraction cost; ten times that covers the
        // roundings of the products before it.
        let tolerance = 10.0 * apart.relative_error;
        assert!(tolerance < 1e-12, "golden bodies are well conditioned");
        close("mass", &[apart.body.mass()], &[b.mass()], tolerance);
        close(
            "r",
            apart.body.r_og_b().as_slice(),
            b.r_og_b().as_slice(),
            tolerance,
        );
        close(
            "tensor",
            apart.body.inertia_cg().as_slice(),
            b.inertia_cg().as_slice(),
            tolerance,
        );
        let back = mass_matrix_at_cg(&b.mass_matrix(), &b.r_og_b());
        close(
            "M_CG",
            back.as_slice(),
            b.mass_matrix_cg().as_slice(),
            1e-12,
        );
        let forth = mass_matrix_at_origin(&b.mass_matrix_cg(), &b.r_og_b());
        close("M_CO", forth.as_slice(), b.mass_matrix().as_slice(), 1e-14);
    }
}

#[test]
fn a_far_away_body_confesses_the_digits_it_lost() {
    // m r^2 / I = 1e8: eight digits go.
    let b = RigidBody::new(1.0, Vector3::new(1e4, 0.0, 0.0), Matrix3::identity()).unwrap();
    let apart = RigidBody::from_mass_matrix(&b.mass_matrix()).unwrap();
    let error = (apart.body.inertia_cg() - Matrix3::identity()).amax();
    assert!(apart.relative_error > 1e-9 && apart.relative_error < 1e-7);
    assert!(error <= apart.relative_error, "{error:e}");
}

#[test]
#[cfg_attr(not(has_shared), ignore = "needs ../shared (optional recordings)")]
fn every_golden_composite_agrees() {
    let Some(golden) = golden() else { return };
    let composites = golden["composites"].as_array().unwrap();
    assert_eq!(composites.len(), 10);
    for (i, g) in composites.iter().enumerate() {
        let parts: Vec<_> = g["parts"].as_array().unwrap().iter().map(body).collect();
        let whole = RigidBody::combined(&parts).unwrap();
        let check = |key: &str, ours: &[f64]| {
            close(
                &format!("composite {i} {key}"),
                ours,
                &numbers(&g[key]),
                1e-12,
            );
        };
        check("m", &[whole.mass()]);
        check("r_g", whole.r_og_b().as_slice());
        check("I_G", whole.inertia_cg().as_slice());
        check("M_CO", &rows6(&whole.mass_matrix()));
        let sum: Matrix6<f64> = parts.iter().map(RigidBody::mass_matrix).sum();
        check("M_CO", &rows6(&sum));

        // One part taken away again leaves the others.
        let (last, rest) = parts.split_last().unwrap();
        let left = whole.without_payload(last).unwrap();
        let others = RigidBody::combined(rest).unwrap();
        // Differences of numbers of the whole's size: its largest moment sets the scale.
        let scale = whole.inertia_cg().amax() / others.inertia_cg().amax();
        close(
            "left over",
            left.inertia_cg().as_slice(),
            others.inertia_cg().as_slice(),
            1e-13 * scale.max(1.0),
        );
    }
}

#[test]
#[cfg_attr(not(has_shared), ignore = "needs ../shared (optional recordings)")]
fn every_golden_invalid_body_is_refused_for_its_own_reason() {
    let Some(golden) = golden() else { return };
    let cases = golden["invalid"].as_array().unwrap();
    assert_eq!(cases.len(), 5);
    for case in cases {
        let name = case["name"].as_str().unwrap();
        let error = RigidBody::new(
            case["m"].as_f64().unwrap(),
            Vector3::zeros(),
            matrix3(&case["I_G"]),
        )
        .unwrap_err();
        let right = match name {
            "triangle" => {
                matches!(error, InertiaError::TriangleInequality { moments: [.., c] } if (c - 3.0).abs() < 1e-14)
            }
            "negative mass" | "zero mass" => matches!(error, InertiaError::MassNotPositive { .. }),
            "not positive" => {
                matches!(error, InertiaError::NotPositive { moments: [a, ..] } if (a + 1.0).abs() < 1e-14)
            }
            "asymmetric" => {
                matches!(error, InertiaError::NotSymmetric { row: 0, column: 1, difference, .. } if difference == 0.1)
            }
            other => panic!("unknown case {other}"),
        };
        assert!(right, "{name}: {error:?}");
        assert!(error.to_string().len() > 10);
    }
}

#[test]
fn hostile_numbers_are_refused_not_propagated() {
    let bad = [f64::NAN, f64::INFINITY, -f64::INFINITY, 1e200];
    for x in bad {
        let tensor = Matrix3::from_diagonal(&Vector3::new(x, 1.0, 1.0));
        assert!(
            RigidBody::new(1.0, Vector3::zeros(), tensor).is_err(),
            "{x}"
        );
        assert!(
            RigidBody::new(1.0, Vector3::new(0.0, x, 0.0), Matrix3::identity()).is_err(),
            "{x}"
        );
        let mut m = Matrix6::identity();
        m[(4, 1)] = x;
        assert!(RigidBody::from_mass_matrix(&m).is_err());
        assert!(AddedMass::new(m).is_err());
    }
    for x in [f64::NAN, f64::INFINITY, 0.0, -1.0] {
        assert!(RigidBody::new(x, Vector3::zeros(), Matrix3::identity()).is_err());
    }
    let b = RigidBody::new(1.0, Vector3::zeros(), Matrix3::identity()).unwrap();
    assert!(b.resolved_in(&(Matrix3::identity() * 1.1)).is_err());
    assert!(b.resolved_in(&-Matrix3::identity()).is_err(), "a mirror");
    assert!(b.resolved_in(&Matrix3::from_element(f64::NAN)).is_err());
    assert_eq!(RigidBody::combined(&[]), Err(InertiaError::NoBodies));
    // A fluid that would push by itself.
    let mut negative = Matrix6::identity();
    negative[(2, 2)] = -1e-3;
    assert_eq!(AddedMass::new(negative), Err(InertiaError::NotInvertible));
    assert!(AddedMass::new(Matrix6::zeros()).is_ok(), "no fluid at all");
}

fn seed_example() -> RigidBody {
    RigidBody::new(
        1000.0,
        Vector3::new(0.5, 0.0, 0.3),
        Matrix3::from_diagonal(&Vector3::new(500.0, 2000.0, 2100.0)),
    )
    .unwrap()
}

#[test]
#[cfg_attr(not(has_shared), ignore = "needs ../shared (optional recordings)")]
fn seed_i2_the_example_has_a_product_of_inertia_of_150() {
    let m = seed_example().mass_matrix();
    // Products of a thousand, a half and three tenths: one rounding of 150.
    assert!((m[(3, 5)] + 150.0).abs() < 1e-13 && m[(5, 3)] == m[(3, 5)]);
    assert_eq!((m[(3, 4)], m[(4, 5)]), (0.0, 0.0));
    for (i, expected) in [(3, 590.0), (4, 2340.0), (5, 2350.0)] {
        assert!((m[(i, i)] - expected).abs() < 1e-12);
    }
    if let Some(golden) = golden() {
        close(
            "seed",
            &rows6(&m),
            &numbers(&golden["seed_example"]["M_CO"]),
            1e-15,
        );
    }
}

#[test]
fn seed_i3_parallel_axes_take_the_distance_of_the_axes_not_of_the_points() {
    let b = seed_example();
    let wrong = b.inertia_cg() + Matrix3::identity() * (b.mass() * b.r_og_b().norm_squared());
    let right = b.inertia_at_origin();
    // The document's sentence gives 840, its own numbers say 590.
    assert!((wrong[(0, 0)] - 840.0).abs() < 1e-9);
    assert!((right[(0, 0)] - 590.0).abs() < 1e-9);
    // Two masses of 500 kg at +-1 m along x seen from 1 m along x: nothing changes about x.
    let rod = RigidBody::new(1.0, Vector3::x(), Matrix3::identity()).unwrap();
    assert_eq!(rod.inertia_at_origin()[(0, 0)], 1.0);
}

#[test]
fn seed_i4_a_pure_moment_does_not_accelerate_the_centre_of_gravity() {
    let b = seed_example();
    let a = b
        .acceleration(
            &Vector6::zeros(),
            &Vector6::new(0.0, 0.0, 0.0, 10.0, -20.0, 30.0),
        )
        .unwrap();
    let (v_dot, w_dot) = (
        Vector3::new(a[0], a[1], a[2]),
        Vector3::new(a[3], a[4], a[5]),
    );
    assert!(v_dot.norm() > 1e-3, "the origin does accelerate");
    // Two roundings of numbers of size 1e-2.
    assert!((v_dot + w_dot.cross(&b.r_og_b())).norm() < 1e-17);
}

#[test]
fn seed_i10_positive_definite_is_not_enough() {
    let spd = Matrix3::from_diagonal(&Vector3::new(1.0, 1.0, 3.0));
    assert!(matches!(
        RigidBody::new(1.0, Vector3::zeros(), spd),
        Err(InertiaError::TriangleInequality { .. })
    ));
    // The limit, a flat plate, is physical.
    let plate = Matrix3::from_diagonal(&Vector3::new(1.0, 2.0, 3.0));
    let plate = RigidBody::new(1.0, Vector3::zeros(), plate).unwrap();
    let smallest = Matrix4::symmetric_eigen(plate.pseudo_inertia())
        .eigenvalues
        .min();
    // All matter in one plane: one second moment is zero, to rounding of 3.
    assert!(smallest.abs() < 1e-15);
}

#[test]
fn seed_i12_the_two_signs_of_the_products_are_two_bodies() {
    let moments = [20.0, 40.0, 45.0];
    let fossen = RigidBody::from_products_of_inertia(
        1.0,
        Vector3::zeros(),
        moments,
        ProductsOfInertia {
            xy: 3.0,
            yz: -4.0,
            xz: 5.0,
        },
    )
    .unwrap();
    let urdf = |sign: f64| {
        RigidBody::from_tensor_entries(
            1.0,
            Vector3::zeros(),
            TensorEntries {
                ixx: 20.0,
                ixy: sign * 3.0,
                ixz: sign * 5.0,
                iyy: 40.0,
                iyz: sign * -4.0,
                izz: 45.0,
            },
        )
        .unwrap()
    };
    assert_eq!(fossen, urdf(-1.0));
    let mixed = urdf(1.0).principal_moments();
    let apart = (mixed[0] - fossen.principal_moments()[0]).abs();
    assert!(
        apart > 0.1,
        "mixing the signs moves the principal moments by {apart}"
    );
}

#[test]
fn a_cloud_of_particles_has_the_same_tensor_momentum_and_energy() {
    // Independent of every formula here: sums over points.
    let points: Vec<(f64, Vector3<f64>)> = (0..12)
        .map(|i| {
            let a = f64::from(i);
            (
                1.0 + 0.1 * a,
                Vector3::new((1.3 * a).sin(), (0.7 * a + 1.0).cos(), 0.1 * a - 0.4),
            )
        })
        .collect();
    let mass: f64 = points.iter().map(|p| p.0).sum();
    let r: Vector3<f64> = points.iter().map(|p| p.1 * p.0).sum::<Vector3<f64>>() / mass;
    let tensor: Matrix3<f64> = points
        .iter()
        .map(|(m, x)| skew(&(x - r)).transpose() * skew(&(x - r)) * *m)
        .sum();
    let b = RigidBody::new(mass, r, tensor).unwrap();
    let nu = Vector6::new(0.4, -1.0, 2.0, 0.3, 0.9, -1.7);
    let (v, w) = (Vector3::new(0.4, -1.0, 2.0), Vector3::new(0.3, 0.9, -1.7));
    let velocity = |x: &Vector3<f64>| v + w.cross(x);
    let energy: f64 = points
        .iter()
        .map(|(m, x)| 0.5 * m * velocity(x).norm_squared())
        .sum();
    let p: Vector3<f64> = points.iter().map(|(m, x)| velocity(x) * *m).sum();
    let h: Vector3<f64> = points.iter().map(|(m, x)| x.cross(&velocity(x)) * *m).sum();
    // C(nu) nu is the force each particle needs to go round: m w x velocity.
    let f: Vector3<f64> = points.iter().map(|(m, x)| w.cross(&velocity(x)) * *m).sum();
    let n: Vector3<f64> = points
        .iter()
        .map(|(m, x)| x.cross(&w.cross(&velocity(x))) * *m)
        .sum();
    // Twelve summands each: a few ulps of the largest.
    close("energy", &[b.kinetic_energy(&nu)], &[energy], 1e-14);
    close("p", &b.momentum(&nu).as_slice()[..3], p.as_slice(), 1e-14);
    close("h", &b.momentum(&nu).as_slice()[3..], h.as_slice(), 1e-14);
    close("f", &b.coriolis(&nu).as_slice()[..3], f.as_slice(), 1e-14);
    close("n", &b.coriolis(&nu).as_slice()[3..], n.as_slice(), 1e-14);
}

#[test]
fn another_origin_and_other_axes_are_the_same_body() {
    let b = seed_example()
        .with_point_mass(50.0, Vector3::new(-0.7, 0.4, 0.2))
        .unwrap();
    let r_op = Vector3::new(0.2, -0.5, 1.0);
    let moved = b.seen_from(r_op).unwrap();
    let transform = system_transform(&-r_op);
    let by_transform = transform.transpose() * b.mass_matrix() * transform;
    // Six products of numbers up to 3000.
    close(
        "moved",
        moved.mass_matrix().as_slice(),
        by_transform.as_slice(),
        1e-14,
    );
    // Witness: a quarter turn about z takes b's x to a's y.
    let c_ab = Matrix3::new(0.0, -1.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0);
    let turned = b.resolved_in(&c_ab).unwrap();
    assert_eq!(turned.inertia_cg()[(1, 1)], b.inertia_cg()[(0, 0)]);
    assert_eq!(
        turned.r_og_b(),
        Vector3::new(-b.r_og_b().y, b.r_og_b().x, b.r_og_b().z)
    );
    let by_matrix = rotated_mass_matrix(&b.mass_matrix(), &c_ab).unwrap();
    close(
        "turned",
        turned.mass_matrix().as_slice(),
        by_matrix.as_slice(),
        1e-15,
    );
}

#[test]
fn a_point_mass_is_a_ball_shrunk_to_nothing() {
    let b = seed_example();
    let at = Vector3::new(1.0, -2.0, 0.5);
    let ball = RigidBody::new(70.0, at, Matrix3::identity() * 1e-13).unwrap();
    let with_ball = b.with_payload(&ball).unwrap();
    let with_point = b.with_point_mass(70.0, at).unwrap();
    // The ball's own 1e-13 and roundings of 3000.
    let difference = (with_ball.inertia_cg() - with_point.inertia_cg()).amax();
    assert!(difference < 2e-12, "{difference:e}");
    assert!((with_ball.r_og_b() - with_point.r_og_b()).norm() < 1e-15);
}

#[test]
fn what_was_never_part_of_a_body_can_not_be_taken_from_it() {
    let b = seed_example();
    let heavier = RigidBody::new(1001.0, Vector3::zeros(), Matrix3::identity()).unwrap();
    assert!(matches!(
        b.without_payload(&heavier),
        Err(InertiaError::MassNotPositive { .. })
    ));
    let bulky = RigidBody::new(1.0, b.r_og_b(), Matrix3::identity() * 600.0).unwrap();
    assert!(matches!(
        b.without_payload(&bulky),
        Err(InertiaError::NotPositive { .. })
    ));
}

// ---- motion: what an energy test does not see ----

fn turned(q: &Pose, v: &Vector3<f64>) -> Vector3<f64> {
    let [w, x, y, z] = q.q_nb.wxyz();
    let u = Vector3::new(x, y, z);
    v + 2.0 * u.cross(&(u.cross(v) + w * v))
}

/// A free body under a given law for nu_dot, 5 s by classical Runge-Kutta; the worst drift of linear
/// momentum (relative) and of kinetic energy (relative).
fn free_flight(
    b: &RigidBody,
    nu: Vector6<f64>,
    nu_dot: &dyn Fn(&Vector6<f64>) -> Vector6<f64>,
) -> (f64, f64) {
    let h = 1e-3;
    let mut pose = Pose {
        p_o_n: Vector3::zeros(),
        q_nb: Quaternion::identity(),
        nu,
    };
    let momentum = |p: &Pose| {
        let m = b.momentum(&p.nu);
        turned(p, &Vector3::new(m[0], m[1], m[2]))
    };
    let (p0, e0) = (momentum(&pose), b.kinetic_energy(&nu));
    let (mut worst_p, mut worst_e) = (0.0_f64, 0.0_f64);
    let rate = |q: &[f64; 4], nu: &Vector6<f64>| {
        let [w, x, y, z] = *q;
        let (a, b, c) = (nu[3], nu[4], nu[5]);
        [
            -0.5 * (x * a + y * b + z * c),
            0.5 * (w * a + y * c - z * b),
            0.5 * (w * b + z * a - x * c),
            0.5 * (w * c + x * b - y * a),
        ]
    };
    for _ in 0..5000 {
        let q = pose.q_nb.wxyz();
        let along = |d: &[f64; 4], s: f64| std::array::from_fn::<f64, 4, _>(|i| q[i] + s * d[i]);
        let n1 = nu_dot(&pose.nu);
        let q1 = rate(&q, &pose.nu);
        let n2 = nu_dot(&(pose.nu + 0.5 * h * n1));
        let q2 = rate(&along(&q1, 0.5 * h), &(pose.nu + 0.5 * h * n1));
        let n3 = nu_dot(&(pose.nu + 0.5 * h * n2));
        let q3 = rate(&along(&q2, 0.5 * h), &(pose.nu + 0.5 * h * n2));
        let n4 = nu_dot(&(pose.nu + h * n3));
        let q4 = rate(&along(&q3, h), &(pose.nu + h * n3));
        pose.nu += h / 6.0 * (n1 + 2.0 * n2 + 2.0 * n3 + n4);
        let q: [f64; 4] =
            std::array::from_fn(|i| q[i] + h / 6.0 * (q1[i] + 2.0 * (q2[i] + q3[i]) + q4[i]));
        let norm = q.iter().map(|x| x * x).sum::<f64>().sqrt();
        pose.q_nb = Quaternion::assume_unit(q.map(|x| x / norm));
        worst_p = worst_p.max((momentum(&pose) - p0).norm() / p0.norm());
        worst_e = worst_e.max((b.kinetic_energy(&pose.nu) / e0 - 1.0).abs());
    }
    (worst_p, worst_e)
}

/// C_RB as the source document prints it.
fn seed_c_rb(b: &RigidBody, nu: &Vector6<f64>) -> Matrix6<f64> {
    let (v, w) = (
        Vector3::new(nu[0], nu[1], nu[2]),
        Vector3::new(nu[3], nu[4], nu[5]),
    );
    let m = b.mass();
    let mut c = Matrix6::zeros();
    c.fixed_view_mut::<3, 3>(0, 3)
        .copy_from(&(-m * skew(&w) - m * skew(&v) * skew(&b.r_og_b()) / v.norm()));
    c.fixed_view_mut::<3, 3>(3, 0).copy_from(&(-m * skew(&w)));
    c.fixed_view_mut::<3, 3>(3, 3)
        .copy_from(&-skew(&(b.inertia_at_origin() * w)));
    c
}

#[test]
fn seed_i7_its_c_rb_makes_momentum_of_nothing() {
    let b = seed_example();
    let m_inverse = b.mass_matrix().try_inverse().unwrap();
    let nu = Vector6::new(2.0, -0.5, 0.3, 0.2, -0.4, 0.5);
    let seed = free_flight(&b, nu, &|nu| m_inverse * -(seed_c_rb(&b, nu) * nu));
    let ours = free_flight(&b, nu, &|nu| b.acceleration(nu, &Vector6::zeros()).unwrap());
    println!("5 s of free flight, drift of momentum and energy: seed {seed:?}, ours {ours:?}");
    assert!(seed.0 > 0.5, "{seed:?}");
    // RK4 at 1e-3 s and 0.7 rad/s: 1e-13 a step or less, and roundings.
    assert!(ours.0 < 1e-12 && ours.1 < 1e-12, "{ours:?}");
    // Straight ahead while yawing: no m w x v, and a moment that is not there.
    let at_cg = RigidBody::new(1000.0, Vector3::zeros(), b.inertia_cg()).unwrap();
    let nu = Vector6::new(2.0, 0.0, 0.0, 0.0, 0.0, 0.5);
    assert_eq!(
        at_cg.coriolis(&nu),
        Vector6::new(0.0, 1000.0, 0.0, 0.0, 0.0, 0.0)
    );
    assert_eq!(
        seed_c_rb(&at_cg, &nu) * nu,
        Vector6::new(0.0, 0.0, 0.0, 0.0, -1000.0, 0.0)
    );
    // At rest it is not a number.
    assert!(
        (seed_c_rb(&b, &Vector6::zeros()) * nu)
            .iter()
            .any(|x| x.is_nan())
    );
}

#[test]
#[cfg_attr(not(has_shared), ignore = "needs ../shared (optional recordings)")]
fn seed_i7_an_energy_test_does_not_see_the_wrong_c_rb() {
    let Some(golden) = golden() else { return };
    for g in golden["bodies"].as_array().unwrap() {
        let (b, nu) = (body(g), vector6(&g["nu"]));
        let force = seed_c_rb(&b, &nu) * nu;
        let power = nu.dot(&force) / (nu.norm() * force.norm());
        // It does no work: roundings of products that cancel.
        assert!(power.abs() < 1e-13, "{power:e}");
        let off = (force - b.coriolis(&nu)).norm() / b.coriolis(&nu).norm();
        assert!(off > 0.2, "and it is wrong by {off}");
    }
}

#[test]
fn seed_i6_without_the_coriolis_term_a_free_body_gains_momentum() {
    let b = seed_example();
    let nu = Vector6::new(2.0, -0.5, 0.3, 0.2, -0.4, 0.5);
    let drift = free_flight(&b, nu, &|_| Vector6::zeros());
    assert!(drift.0 > 0.5, "{drift:?}");
}

#[test]
#[cfg_attr(not(has_shared), ignore = "needs ../shared (optional recordings)")]
fn a_free_body_keeps_momentum_and_energy_with_and_without_added_mass() {
    let Some(golden) = golden() else { return };
    for g in golden["bodies"].as_array().unwrap().iter().take(10) {
        let b = body(g);
        for added in [None, Some(AddedMass::new(matrix6(&g["M_A"])).unwrap())] {
            let vessel = Vessel::new(b, added).unwrap();
            let mut pose = Pose {
                p_o_n: Vector3::new(1.0, -2.0, 3.0),
                q_nb: Quaternion::assume_unit([0.5, -0.5, 0.1, 0.7]),
                nu: vector6(&g["nu"]),
            };
            let (p0, h0) = vessel.momentum_n(&pose);
            let e0 = vessel.kinetic_energy(&pose.nu);
            let h = 2e-3;
            for n in 0..2500 {
                pose = vessel
                    .step(f64::from(n) * h, &pose, h, |_, _| Vector6::zeros())
                    .unwrap();
            }
            let (p, l) = vessel.momentum_n(&pose);
            // 2500 steps of order 6 at some rad/s (1e-17 a step) and their roundings.
            assert!((p - p0).norm() < 1e-11 * p0.norm());
            assert!((l - h0).norm() < 1e-11 * h0.norm());
            assert!((vessel.kinetic_energy(&pose.nu) / e0 - 1.0).abs() < 1e-12);
        }
    }
}

#[test]
fn a_thrown_body_falls_with_its_centre_of_gravity_on_a_parabola() {
    let b = seed_example();
    let vessel = Vessel::new(b, None).unwrap();
    let gravity = Vector3::new(0.0, 0.0, -9.8);
    let mut pose = Pose {
        p_o_n: Vector3::zeros(),
        q_nb: Quaternion::identity(),
        nu: Vector6::new(3.0, 1.0, 8.0, 0.5, -1.0, 2.0),
    };
    let cg = |p: &Pose| p.p_o_n + turned(p, &b.r_og_b());
    let start = cg(&pose);
    let (v, w) = (Vector3::new(3.0, 1.0, 8.0), Vector3::new(0.5, -1.0, 2.0));
    let v_cg = v + w.cross(&b.r_og_b());
    let h = 1e-3;
    for n in 0..1500 {
        pose = vessel
            .step(f64::from(n) * h, &pose, h, |_, p| {
                vessel.weight(p, &gravity)
            })
            .unwrap();
    }
    // Weight acts at the centre of gravity: it does not turn the body.
    let mut weightless = Pose {
        q_nb: Quaternion::identity(),
        p_o_n: Vector3::zeros(),
        nu: Vector6::new(3.0, 1.0, 8.0, 0.5, -1.0, 2.0),
    };
    for n in 0..1500 {
        weightless = vessel
            .step(f64::from(n) * h, &weightless, h, |_, _| Vector6::zeros())
            .unwrap();
    }
    let turned_otherwise =
        (turned(&pose, &Vector3::x()) - turned(&weightless, &Vector3::x())).norm();
    // 1500 roundings of a few rad/s.
    assert!(turned_otherwise < 1e-12, "{turned_otherwise:e}");
    let expected = start + v_cg * 1.5 + gravity * (0.5 * 1.5 * 1.5);
    // 1500 roundings of 10 m.
    assert!(
        (cg(&pose) - expected).norm() < 1e-11,
        "{}",
        cg(&pose) - expected
    );
}
