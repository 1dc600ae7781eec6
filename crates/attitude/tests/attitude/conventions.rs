//! Meaning of every sign, order and direction, each with a witness that a transpose, a swapped order
//! or a half conversion would fail. The document's wrong equations are named and refuted
//! (docs/top.md).

use nalgebra::{Matrix3, Vector3};
use proptest::prelude::*;
use std::f64::consts::{FRAC_1_SQRT_2 as H, FRAC_PI_2, PI};
use strapd_attitude::frames::{
    Attitude, AxisMap, AxisMapError, Body, BodyAxes, Dcm, Enu, Flu, Frd, In, Nav, Ned, Nwu, Sensor,
};
use strapd_attitude::quaternion::{
    BodyRate, Quaternion, RotationVector, YawPitchRoll, exp_minus_one,
};
use strapd_attitude::worlds::{
    Convention, World, enu_flu_from_ned_frd, enu_flu_from_nwu_flu, enu_from_ned, flu_from_frd,
    frd_from_flu, ned_frd_from_enu_flu, ned_frd_from_nwu_flu, ned_from_enu, nwu_flu_from_enu_flu,
    nwu_flu_from_ned_frd,
};

type Q = Quaternion<Nav, Body>;

/// A few roundings of numbers up to 1.
const ROUNDING: f64 = 2e-15;

fn phi(x: f64, y: f64, z: f64) -> RotationVector {
    RotationVector(Vector3::new(x, y, z))
}

fn in_body(x: f64, y: f64, z: f64) -> In<Body> {
    In::assume(Vector3::new(x, y, z))
}

#[track_caller]
fn close<F>(got: In<F>, want: [f64; 3]) {
    let error = (got.as_vector() - Vector3::from(want)).amax();
    assert!(error < ROUNDING, "{got:?} is not {want:?}");
}

fn angle_between(a: &Matrix3<f64>, b: &Matrix3<f64>) -> f64 {
    let of = |m: &Matrix3<f64>| Q::from_dcm(&Dcm::assume(*m));
    of(a).angle_to(&of(b))
}

// ---- witnesses ----

#[test]
fn two_different_quarter_turns_tell_order_and_direction() {
    // Yaw left a quarter turn (about z), then roll a quarter turn about the body's own new x.
    let q = Q::identity()
        .advanced(&phi(0.0, 0.0, FRAC_PI_2))
        .advanced(&phi(FRAC_PI_2, 0.0, 0.0));
    // The nose points along n's y; the left wing up; the roof along n's x. Any transpose or swapped
    // order gives something else: x -> (0,0,1), or y -> (-1,0,0), or z -> (0,-1,0).
    close(q * in_body(1.0, 0.0, 0.0), [0.0, 1.0, 0.0]);
    close(q * in_body(0.0, 1.0, 0.0), [0.0, 0.0, 1.0]);
    close(q * in_body(0.0, 0.0, 1.0), [1.0, 0.0, 0.0]);

    let c: Attitude = q.to_dcm();
    close(c * in_body(1.0, 2.0, 3.0), [3.0, 1.0, 2.0]);
    close(q * in_body(1.0, 2.0, 3.0), [3.0, 1.0, 2.0]);
    let back: In<Body> = c.transpose() * In::<Nav>::assume(Vector3::new(3.0, 1.0, 2.0));
    close(back, [1.0, 2.0, 3.0]);

    // w, x, y, z, scalar first, all of the same sign.
    for (got, want) in q.wxyz().into_iter().zip([0.5; 4]) {
        assert!((got - want).abs() < ROUNDING);
    }
    let angles = q.yaw_pitch_roll();
    assert!((angles.yaw - FRAC_PI_2).abs() < ROUNDING && angles.pitch.abs() < ROUNDING);
    assert!((angles.roll - FRAC_PI_2).abs() < ROUNDING);
}

#[test]
fn products_read_from_the_left_frame_to_the_right_one() {
    let q_nb = Q::assume_unit([H, 0.0, 0.0, H]); // b is n turned a quarter about z
    let q_bs = Quaternion::<Body, Sensor>::assume_unit([H, H, 0.0, 0.0]); // s is b turned about x
    let q_ns: Quaternion<Nav, Sensor> = q_nb * q_bs;
    let f_s = In::<Sensor>::assume(Vector3::new(1.0, 2.0, 3.0));
    close(q_ns * f_s, [3.0, 1.0, 2.0]);
    close(q_nb * (q_bs * f_s), [3.0, 1.0, 2.0]);
    close(q_nb.to_dcm() * q_bs.to_dcm() * f_s, [3.0, 1.0, 2.0]);
    assert!(Q::from_dcm(&q_nb.to_dcm()).angle_to(&q_nb) < ROUNDING);
}

#[test]
fn yaw_pitch_and_roll_turn_about_z_then_y_then_x() {
    let q = |yaw: f64, pitch: f64, roll: f64| {
        Q::from_yaw_pitch_roll(&YawPitchRoll { yaw, pitch, roll })
    };
    close(
        q(FRAC_PI_2, 0.0, 0.0) * in_body(1.0, 0.0, 0.0),
        [0.0, 1.0, 0.0],
    );
    close(
        q(0.0, FRAC_PI_2, 0.0) * in_body(1.0, 0.0, 0.0),
        [0.0, 0.0, -1.0],
    );
    close(
        q(0.0, 0.0, FRAC_PI_2) * in_body(0.0, 1.0, 0.0),
        [0.0, 0.0, 1.0],
    );
    // Yaw first, pitch about the new y: the nose ends on -z whatever the yaw, the left wing on -x.
    close(
        q(FRAC_PI_2, FRAC_PI_2, 0.0) * in_body(1.0, 0.0, 0.0),
        [0.0, 0.0, -1.0],
    );
    close(
        q(FRAC_PI_2, FRAC_PI_2, 0.0) * in_body(0.0, 1.0, 0.0),
        [-1.0, 0.0, 0.0],
    );
}

#[test]
fn a_positive_body_rate_turns_the_right_handed_way() {
    // 1 rad/s about the body's z for a quarter turn: the nose goes from n's x to n's y.
    let turned = BodyRate(Vector3::z())
        .held_for(FRAC_PI_2)
        .about_fixed_axis();
    close(
        Q::identity().advanced(&turned) * in_body(1.0, 0.0, 0.0),
        [0.0, 1.0, 0.0],
    );
}

// ---- conventions of other worlds ----

#[test]
fn ned_frd_becomes_enu_flu_by_the_formula_of_the_books() {
    // q(0, s, s, 0) q q(0, 1, 0, 0).
    let q = Quaternion::<Ned, Frd>::assume_unit([0.3, -0.5, 0.1, 0.8]).normalised();
    let by_formula = Quaternion::<Enu, Ned>::assume_unit([0.0, H, H, 0.0])
        * q
        * Quaternion::<Frd, Flu>::assume_unit([0.0, 1.0, 0.0, 0.0]);
    assert!(enu_flu_from_ned_frd(q).angle_to(&by_formula) < ROUNDING);
}

#[test]
fn an_aircraft_flying_east_nose_up_right_wing_down_does_so_in_every_convention() {
    let angles = |yaw: f64, pitch: f64, roll: f64| YawPitchRoll {
        yaw: yaw.to_radians(),
        pitch: pitch.to_radians(),
        roll: roll.to_radians(),
    };
    // NED/FRD: yaw from north to the right, pitch nose up, roll right wing down.
    let ned = Quaternion::<Ned, Frd>::from_yaw_pitch_roll(&angles(90.0, 10.0, 20.0));
    // ENU/FLU: yaw from east to the left, pitch nose down. NWU: yaw from north to the left.
    let enu = Quaternion::<Enu, Flu>::from_yaw_pitch_roll(&angles(0.0, -10.0, 20.0));
    let nwu = Quaternion::<Nwu, Flu>::from_yaw_pitch_roll(&angles(-90.0, -10.0, 20.0));
    assert!(enu_flu_from_ned_frd(ned).angle_to(&enu) < ROUNDING);
    assert!(ned_frd_from_enu_flu(enu).angle_to(&ned) < ROUNDING);
    assert!(nwu_flu_from_ned_frd(ned).angle_to(&nwu) < ROUNDING);
    assert!(ned_frd_from_nwu_flu(nwu).angle_to(&ned) < ROUNDING);
    assert!(nwu_flu_from_enu_flu(enu).angle_to(&nwu) < ROUNDING);
    assert!(enu_flu_from_nwu_flu(nwu).angle_to(&enu) < ROUNDING);
}

#[test]
fn half_a_conversion_puts_the_vehicle_on_its_back() {
    // Level, facing north, in NED/FRD; the world turned to ENU and the body forgotten.
    let half =
        Quaternion::<Enu, Ned>::assume_unit([0.0, H, H, 0.0]) * Quaternion::<Ned, Flu>::identity();
    let roof = half * In::<Flu>::assume(Vector3::z());
    close(roof, [0.0, 0.0, -1.0]); // the roof points down: microstrain_mips#4, vectornav#146
    let whole = enu_flu_from_ned_frd(Quaternion::identity());
    close(whole * In::<Flu>::assume(Vector3::z()), [0.0, 0.0, 1.0]);
    close(whole * In::<Flu>::assume(Vector3::x()), [0.0, 1.0, 0.0]); // nose north
}

#[test]
fn labels_of_the_command_line_mean_what_they_say() {
    assert_eq!("flu".parse(), Ok(BodyAxes::Flu));
    assert_eq!("FRD".parse(), Ok(BodyAxes::Frd));
    let v_s = In::<Sensor>::assume(Vector3::new(1.0, 2.0, 3.0));
    close(BodyAxes::Flu.c_bs().unwrap() * v_s, [1.0, 2.0, 3.0]);
    close(BodyAxes::Frd.c_bs().unwrap() * v_s, [1.0, -2.0, -3.0]);
    assert_eq!(BodyAxes::Frd.map(), "Xyz".parse().unwrap());
    assert_eq!(BodyAxes::Flu.map(), AxisMap::default());
    // gyroflow#144: `YxZ` takes y for x and -x for y.
    let map: BodyAxes = "YxZ".parse().unwrap();
    close(map.c_bs().unwrap() * v_s, [2.0, -1.0, 3.0]);
    assert_eq!(map.to_string(), "YxZ");
    for world in [World::Start, World::Enu, World::Ned, World::Nwu] {
        assert_eq!(world.to_string().parse(), Ok(world));
    }
    let error = "\u{7}east-north-up-please"
        .parse::<World>()
        .unwrap_err()
        .to_string();
    assert!(
        error.starts_with("`\\u{7}east-north-up-p...` is no world"),
        "{error}"
    );
}

#[test]
fn of_the_48_axis_maps_24_are_rotations_and_24_are_refused_as_mirrors() {
    let (mut rotations, mut mirrors) = (0, 0);
    for order in ["XYZ", "XZY", "YXZ", "YZX", "ZXY", "ZYX"] {
        for signs in 0..8 {
            let text: String = order
                .chars()
                .enumerate()
                .map(|(i, c)| {
                    if signs >> i & 1 == 1 {
                        c.to_ascii_lowercase()
                    } else {
                        c
                    }
                })
                .collect();
            let map: AxisMap = text.parse().unwrap();
            assert_eq!(map.inverse().after(map), AxisMap::IDENTITY, "{text}");
            let back = map.reversed().apply([1.0, 2.0, 3.0]).map(|v| -v);
            assert_eq!(back, map.apply([1.0, 2.0, 3.0]), "{text}");
            assert_eq!(map.to_string(), text);
            let v = [1.0, 2.0, 3.0];
            match map.to_dcm::<Body, Sensor>() {
                Some(c) => {
                    rotations += 1;
                    assert_eq!(c.as_matrix().determinant(), 1.0);
                    close(c * In::assume(v.into()), map.apply(v));
                    assert_eq!(text.parse(), Ok(BodyAxes::Map(map)));
                }
                None => {
                    mirrors += 1;
                    assert_eq!(text.parse::<BodyAxes>(), Err(AxisMapError::Mirrors { map }));
                    // The help names a map that is accepted.
                    let error = AxisMapError::Mirrors { map }.to_string();
                    let advice = error.rsplit('`').nth(1).unwrap();
                    assert!(advice.parse::<BodyAxes>().is_ok(), "{error}");
                }
            }
        }
    }
    assert_eq!((rotations, mirrors), (24, 24));
}

#[test]
fn texts_that_are_no_axis_map_are_refused_with_an_example() {
    for text in [
        "",
        "X",
        "XY",
        "XXZ",
        "XyY",
        "XYZX",
        "ABC",
        "X Z",
        "éYZ",
        "fl",
        "fluu",
        "\u{1F600}",
    ] {
        let error = text.parse::<BodyAxes>().unwrap_err();
        assert!(
            matches!(error, AxisMapError::NotAPermutation { .. }),
            "{text}"
        );
        assert!(error.to_string().contains("YxZ"));
    }
    let long = "x".repeat(100_000).parse::<AxisMap>().unwrap_err();
    assert!(long.to_string().len() < 200);
}

#[test]
fn matrices_that_are_no_rotation_are_refused() {
    let try_diagonal = |d: [f64; 3]| Attitude::try_from_matrix(Matrix3::from_diagonal(&d.into()));
    assert!(try_diagonal([1.0, -1.0, -1.0]).is_ok());
    assert!(
        try_diagonal([1.0, 1.0, -1.0])
            .unwrap_err()
            .to_string()
            .contains("mirrors")
    );
    assert!(try_diagonal([1.0, 1.0, 1.01]).is_err());
    assert!(try_diagonal([f64::NAN, 1.0, 1.0]).is_err());
    assert!(try_diagonal([f64::INFINITY, 1.0, 1.0]).is_err());
}

// ---- the document's equations ----

/// A motion with nothing special about it, as yaw, pitch, roll and their rates (closed form).
fn motion(t: f64) -> (Matrix3<f64>, Vector3<f64>) {
    let yaw = 0.9 * t + 0.4 * (2.0 * t).sin();
    let pitch = 0.2 + 0.7 * (1.3 * t).sin();
    let roll = 0.5 - 1.1 * t + 0.3 * (3.0 * t).cos();
    let (dyaw, dpitch, droll) = (
        0.9 + 0.8 * (2.0 * t).cos(),
        0.91 * (1.3 * t).cos(),
        -1.1 - 0.9 * (3.0 * t).sin(),
    );
    let c = Q::from_yaw_pitch_roll(&YawPitchRoll { yaw, pitch, roll }).to_dcm();
    // Body rate of a z-y'-x'' sequence, any textbook (Groves 2013, eq. 2.57).
    let w = Vector3::new(
        droll - dyaw * pitch.sin(),
        dpitch * roll.cos() + dyaw * pitch.cos() * roll.sin(),
        -dpitch * roll.sin() + dyaw * pitch.cos() * roll.cos(),
    );
    (*c.as_matrix(), w)
}

/// The document's CK matrix, entry by entry as printed under its figure 2.
fn ck(v: &Vector3<f64>) -> Matrix3<f64> {
    let angle = v.norm();
    let s = if angle > 0.0 {
        (angle / 2.0).sin() / angle
    } else {
        0.5
    };
    let (a, b, c, d) = ((angle / 2.0).cos(), s * v.x, s * v.y, s * v.z);
    Matrix3::new(
        a * a + b * b - c * c - d * d,
        2.0 * (b * c - a * d),
        2.0 * (b * d + a * c),
        2.0 * (b * c + a * d),
        a * a + c * c - b * b - d * d,
        2.0 * (c * d - a * b),
        2.0 * (b * d - a * c),
        2.0 * (c * d + a * b),
        a * a + d * d - b * b - c * c,
    )
}

#[test]
fn the_seeds_ck_matrix_is_the_active_right_handed_one() {
    let quarter = ck(&Vector3::new(0.0, 0.0, FRAC_PI_2));
    assert!((quarter * Vector3::x() - Vector3::y()).amax() < ROUNDING);
    let v = Vector3::new(0.4, -1.2, 2.0);
    let ours = Q::from_rotation_vector(&RotationVector(v)).to_dcm();
    assert!((ck(&v) - ours.as_matrix()).amax() < ROUNDING);
}

#[test]
fn erratum_eq_8_components_in_the_turned_frame_need_the_transpose_not_ck_itself() {
    // b is s turned a quarter about z, so b's x axis lies on s's y: the vector s_y is x in b.
    let turn = ck(&Vector3::new(0.0, 0.0, FRAC_PI_2));
    assert!((turn.transpose() * Vector3::y() - Vector3::x()).amax() < ROUNDING);
    assert!((turn * Vector3::y() + Vector3::x()).amax() < ROUNDING); // as printed above eq. 8
}

#[test]
fn erratum_eq_12_and_20_the_printed_transpose_is_wrong_and_the_code_is_right() {
    let steps = 20_000;
    let dt = 2.0 / f64::from(steps);
    let mut product = motion(0.0).0;
    let mut sum = Vector3::zeros();
    for i in 0..steps {
        let w = motion((f64::from(i) + 0.5) * dt).1;
        product *= ck(&(w * dt));
        sum += w * dt;
    }
    let truth = motion(2.0).0;
    let deg = |m: &Matrix3<f64>| angle_between(m, &truth).to_degrees();
    // C <- C CK(w dt) with mid-step rates: second order, (1e-4)^2 times rates of a few rad/s.
    assert!(deg(&product) < 1e-6, "{}", deg(&product));
    // As printed: the whole product transposed. Wrong by 97.7 deg.
    let printed = deg(&product.transpose());
    assert!(printed > 90.0, "{printed}");
    // Eq. 13, the sum of rotation vectors: not this motion either, by 87.3 deg.
    let start = Q::from_dcm(&Dcm::assume(motion(0.0).0)).rotation_vector().0;
    let summed = deg(&ck(&(start + sum)));
    assert!(summed > 10.0, "{summed}");
}

#[test]
fn erratum_eq_15_the_rate_of_c_is_c_times_w_cross() {
    let t = 0.7;
    let h = 1e-5;
    let rate = (motion(t + h).0 - motion(t - h).0) / (2.0 * h);
    let (c, w) = motion(t);
    // Central difference: h^2/6 of a third derivative of some tens, and 1e-16/h.
    assert!((rate - c * w.cross_matrix()).amax() < 1e-8);
    // `C x w` read as each column crossed with w, or w as if it were resolved in n: not.
    let columns = Matrix3::from_columns(&[0, 1, 2].map(|i| c.column(i).cross(&w)));
    assert!((rate - columns).amax() > 0.5);
    assert!((rate - w.cross_matrix() * c).amax() > 0.5);
}

/// z-x'-z'' with precession p, nutation th and spin s, as in the top's document.
fn zxz(p: f64, th: f64, s: f64) -> Q {
    Q::from_rotation_vector(&phi(0.0, 0.0, p))
        .advanced(&phi(th, 0.0, 0.0))
        .advanced(&phi(0.0, 0.0, s))
}

#[test]
fn erratum_the_z_x_z_angles_are_singular_at_0_and_180_degrees_not_at_90() {
    // Singular: precession and spin can be traded without moving the body.
    let traded =
        |th: f64, sign: f64| zxz(0.3, th, 0.5).angle_to(&zxz(0.3 + 0.2, th, 0.5 + sign * 0.2));
    assert!(traded(0.0, -1.0) < ROUNDING);
    assert!(traded(PI, 1.0) < ROUNDING);
    for sign in [-1.0, 1.0] {
        assert!(traded(FRAC_PI_2, sign) > 0.2); // regular there
    }
}

#[test]
fn body_rates_of_the_z_x_z_angles_are_those_of_seed_eqs_22_to_24() {
    let (p, th, s) = (0.4, 1.1, -0.8);
    let (dp, dth, ds) = (1.3, -0.6, 2.1);
    let h = 1e-5;
    let at = |k: f64| zxz(p + k * dp * h, th + k * dth * h, s + k * ds * h);
    // Rotation over 2h, in body axes; the commutator adds h^2 of rates of order 1.
    let rate = (at(-1.0).inverse() * at(1.0)).rotation_vector().0 / (2.0 * h);
    let want = Vector3::new(
        dp * th.sin() * s.sin() + dth * s.cos(),
        dp * th.sin() * s.cos() - dth * s.sin(),
        dp * th.cos() + ds,
    );
    assert!((rate - want).amax() < 1e-8, "{rate} {want}");
}

// ---- properties ----

prop_compose! {
    fn any_attitude()(v in prop::array::uniform4(-1.0..1.0f64).prop_filter("too short", |v| {
        v.iter().map(|c| c * c).sum::<f64>() > 1e-3
    })) -> Q {
        Q::assume_unit(v).normalised()
    }
}

prop_compose! {
    fn any_vector()(v in prop::array::uniform3(-4.0..4.0f64)) -> Vector3<f64> {
        Vector3::from(v)
    }
}

/// nalgebra as an independent witness, by component name: its storage is i, j, k, w.
fn of_nalgebra(q: &nalgebra::UnitQuaternion<f64>) -> Q {
    Q::assume_unit([q.w, q.i, q.j, q.k])
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn exp_undoes_log(q in any_attitude()) {
        let again = Q::from_rotation_vector(&q.rotation_vector());
        prop_assert!(again.angle_to(&q) < ROUNDING);
    }

    #[test]
    fn log_undoes_exp_up_to_half_a_turn(v in any_vector(), exponent in -20..=0i32) {
        let v = v / 7.0 * PI * 10f64.powi(exponent); // 4 sqrt(3) < 7
        let again = Q::from_rotation_vector(&RotationVector(v)).rotation_vector().0;
        // 4 ulp of the vector itself, however short it is; near pi the rounding of w is
        // 1e-16 rad of angle and no more.
        prop_assert!((again - v).norm() <= 1e-15 * v.norm().max(1e-300));
    }

    #[test]
    fn exp_minus_one_is_exp_minus_one(v in any_vector()) {
        let [w, x, y, z] = exp_minus_one(&v);
        prop_assert_eq!(Q::from_rotation_vector(&RotationVector(v)).wxyz(), [1.0 + w, x, y, z]);
    }

    #[test]
    fn matrices_of_unit_quaternions_are_rotations_and_come_back(q in any_attitude()) {
        let c = q.to_dcm();
        prop_assert!(c.orthonormality_defect() < 2.0 * ROUNDING);
        prop_assert!(Attitude::try_from_matrix(*c.as_matrix()).is_ok());
        prop_assert!(Q::from_dcm(&c).angle_to(&q) < ROUNDING);
    }

    #[test]
    fn quaternion_and_matrix_turn_vectors_alike(q in any_attitude(), r in any_attitude(), v in any_vector()) {
        let r_bs = Quaternion::<Body, Sensor>::assume_unit(r.wxyz());
        let v = In::<Sensor>::assume(v);
        let by_matrix = q.to_dcm() * r_bs.to_dcm() * v;
        let by_quaternion = (q * r_bs) * v;
        // Components up to 7, some ten roundings.
        prop_assert!((by_matrix.as_vector() - by_quaternion.as_vector()).amax() < 1e-14);
    }

    #[test]
    fn nalgebra_means_the_same_by_every_operation(a in any_vector(), b in any_vector(), v in any_vector()) {
        use nalgebra::UnitQuaternion;
        let (qa, qb) = (UnitQuaternion::from_scaled_axis(a), UnitQuaternion::from_scaled_axis(b));
        let ours = Q::from_rotation_vector(&RotationVector(a));
        prop_assert!(ours.angle_to(&of_nalgebra(&qa)) < ROUNDING);
        prop_assert!(ours.advanced(&RotationVector(b)).angle_to(&of_nalgebra(&(qa * qb))) < 2.0 * ROUNDING);
        prop_assert!((ours.to_dcm().as_matrix() - qa.to_rotation_matrix().matrix()).amax() < ROUNDING);
        prop_assert!(((ours * In::<Body>::assume(v)).as_vector() - qa * v).amax() < 1e-14);
        let angles = YawPitchRoll { yaw: a.x, pitch: a.y, roll: a.z };
        let euler = UnitQuaternion::from_euler_angles(angles.roll, angles.pitch, angles.yaw);
        prop_assert!(Q::from_yaw_pitch_roll(&angles).angle_to(&of_nalgebra(&euler)) < 2.0 * ROUNDING);
    }

    #[test]
    fn yaw_pitch_roll_comes_back(q in any_attitude()) {
        let again = Q::from_yaw_pitch_roll(&q.yaw_pitch_roll());
        prop_assert!(again.angle_to(&q) < 3e-15);
    }

    #[test]
    fn angle_between_does_not_see_what_turns_both(q in any_attitude(), r in any_attitude(), s in any_attitude()) {
        let world = Quaternion::<Ned, Nav>::assume_unit(s.wxyz());
        let (a, b) = ((world * q).angle_to(&(world * r)), q.angle_to(&r));
        prop_assert!((a - b).abs() < 4e-15);
        prop_assert!((r.angle_to(&q) - b).abs() < ROUNDING);
    }

    #[test]
    fn conversions_keep_where_every_body_vector_points(q in any_attitude(), v in any_vector()) {
        let q_ned = Quaternion::<Ned, Frd>::assume_unit(q.wxyz());
        let v_frd = In::<Frd>::assume(v);
        let v_ned = q_ned * v_frd;
        let v_enu = enu_flu_from_ned_frd(q_ned) * flu_from_frd(v_frd);
        prop_assert!((v_enu.as_vector() - enu_from_ned(v_ned).as_vector()).amax() < 1e-14);
        prop_assert_eq!(ned_from_enu(enu_from_ned(v_ned)), v_ned);
        prop_assert_eq!(frd_from_flu(flu_from_frd(v_frd)), v_frd);
    }

    #[test]
    fn conversions_undo_each_other_by_whatever_way(q in any_attitude()) {
        use Convention::{EnuFlu, NedFrd, NwuFlu};
        for from in [EnuFlu, NedFrd, NwuFlu] {
            prop_assert_eq!(from.convert(from, q), q);
            for over in [EnuFlu, NedFrd, NwuFlu] {
                for to in [EnuFlu, NedFrd, NwuFlu] {
                    let direct = from.convert(to, q);
                    let around = over.convert(to, from.convert(over, q));
                    prop_assert!(direct.angle_to(&around) < ROUNDING);
                }
            }
        }
    }
}
