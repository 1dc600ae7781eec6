//! Relative motion as the document's appendices A and B have it, by type and by name.

use nalgebra::{Matrix3, Vector3};
use strapd_attitude::frames::{Dcm, In};
use strapd_bodies::dh::*;

enum Bush {}
enum Cart {}
enum Cloud {}

/// Axes of figure A.1 as table A.1 has them: the bush's x is the cart's y and the cloud's -z.
fn c_bush_cart() -> Matrix3<f64> {
    Matrix3::new(0.0, 1.0, 0.0, -1.0, 0.0, 0.0, 0.0, 0.0, 1.0)
}
fn c_bush_cloud() -> Matrix3<f64> {
    Matrix3::new(0.0, 0.0, -1.0, 0.0, 1.0, 0.0, 1.0, 0.0, 0.0)
}

fn moving<A, B>(c: Matrix3<f64>, r: Vector3<f64>, v: f64) -> RelativeMotion<A, B> {
    RelativeMotion::new(
        Transform::new(Dcm::assume(c), In::assume(r)),
        In::assume(Vector3::new(v, 0.0, 0.0)),
        In::assume(Vector3::zeros()),
    )
}

const TABLE: [(&str, &str, [f64; 3]); 6] = [
    ("bush", "bush", [3.0, 0.0, 0.0]),
    ("bush", "cart", [0.0, 3.0, 0.0]),
    ("bush", "cloud", [0.0, 0.0, -3.0]),
    ("cart", "bush", [2.0, 0.0, 0.0]),
    ("cart", "cart", [0.0, 2.0, 0.0]),
    ("cart", "cloud", [0.0, 0.0, -2.0]),
];

#[test]
fn table_a1_by_type() {
    // The cart rolls at 1 m/s, the cloud drifts at 3 m/s, wherever they are.
    let cart: RelativeMotion<Bush, Cart> = moving(c_bush_cart(), Vector3::new(4.0, 0.0, -1.0), 1.0);
    let cloud: RelativeMotion<Bush, Cloud> =
        moving(c_bush_cloud(), Vector3::new(-7.0, 2.0, 30.0), 3.0);
    let from_cart: RelativeMotion<Cart, Cloud> = cart.inverse() * cloud;
    let to_cart = cart.pose().rotation().transpose();
    let to_cloud = cloud.pose().rotation().transpose();
    let ours = [
        *cloud.velocity().as_vector(),
        *cloud.velocity_in(to_cart).as_vector(),
        *cloud.velocity_in(to_cloud).as_vector(),
        *from_cart.velocity_in(cart.pose().rotation()).as_vector(),
        *from_cart.velocity().as_vector(),
        *from_cart
            .velocity_in(to_cloud * cart.pose().rotation())
            .as_vector(),
    ];
    for (v, (observer, axes, theirs)) in ours.iter().zip(TABLE) {
        assert_eq!(v.as_slice(), theirs, "cloud from {observer} in {axes}");
    }
}

#[test]
fn table_a1_by_name() {
    let mut tree = FrameTree::new("bush");
    tree.add(
        "cart",
        "bush",
        moving(c_bush_cart(), Vector3::new(4.0, 0.0, -1.0), 1.0),
    )
    .unwrap();
    // Hung on the cart, so that its own motion must be added: 2 m/s along the cart's y.
    let c_cart_cloud = c_bush_cart().transpose() * c_bush_cloud();
    let relative = RelativeMotion::new(
        Transform::new(
            Dcm::assume(c_cart_cloud),
            In::assume(Vector3::new(1.0, 2.0, 3.0)),
        ),
        In::assume(Vector3::new(0.0, 2.0, 0.0)),
        In::assume(Vector3::zeros()),
    );
    tree.add("cloud", "cart", relative).unwrap();
    for (relative_to, resolved_in, theirs) in TABLE {
        let asked = Question {
            of: "cloud",
            relative_to,
            resolved_in,
        };
        let (v, w) = tree.velocity(asked).unwrap();
        assert_eq!(v.as_vector().as_slice(), theirs, "{asked:?}");
        assert_eq!(w.as_vector().norm(), 0.0);
    }
    let asked = Question {
        of: "bush",
        relative_to: "sun",
        resolved_in: "bush",
    };
    let refused = tree.velocity(asked).unwrap_err().to_string();
    assert_eq!(refused, "no frame `sun`; known: bush, cart, cloud");
    let again = tree.add("cart", "bush", relative).unwrap_err();
    assert_eq!(
        again,
        FrameTreeError::Twice {
            name: "cart".into()
        }
    );
}

#[test]
fn an_observer_who_turns_sees_what_stands_still_move() {
    // A carousel at 0.5 rad/s, a bush 3 m from its axis: seen from the carousel the bush goes round at 1.5 m/s.
    let carousel: RelativeMotion<Bush, Cart> = RelativeMotion::new(
        Transform::new(Dcm::identity(), In::assume(Vector3::new(-3.0, 0.0, 0.0))),
        In::assume(Vector3::zeros()),
        In::assume(Vector3::new(0.0, 0.0, 0.5)),
    );
    let bush = carousel.inverse();
    assert_eq!(bush.velocity().as_vector(), &Vector3::new(0.0, -1.5, 0.0));
    assert_eq!(bush.rate().as_vector(), &Vector3::new(0.0, 0.0, -0.5));
}

#[test]
fn composition_agrees_with_differences_of_poses() {
    // Two links that turn and slide; the velocity of the outer one against central differences.
    let at = |t: f64| {
        let turn =
            |angle: f64| *nalgebra::Rotation3::from_axis_angle(&Vector3::y_axis(), angle).matrix();
        let a: RelativeMotion<Bush, Cart> = RelativeMotion::new(
            Transform::new(
                Dcm::assume(turn(0.7 * t)),
                In::assume(Vector3::new(0.3 * t, 1.0, 0.0)),
            ),
            In::assume(Vector3::new(0.3, 0.0, 0.0)),
            In::assume(Vector3::new(0.0, 0.7, 0.0)),
        );
        let b: RelativeMotion<Cart, Cloud> = RelativeMotion::new(
            Transform::new(
                Dcm::assume(turn(-1.1 * t)),
                In::assume(Vector3::new(2.0, 0.2 * t, 0.5)),
            ),
            In::assume(Vector3::new(0.0, 0.2, 0.0)),
            In::assume(Vector3::new(0.0, -1.1, 0.0)),
        );
        a * b
    };
    let h = 1e-5;
    let place = |t| *at(t).pose().translation().as_vector();
    let difference = (place(0.4 + h) - place(0.4 - h)) / (2.0 * h);
    let v = at(0.4).velocity();
    assert!(
        (v.as_vector() - difference).norm() < 1e-9,
        "{v:?} {difference}"
    );
    assert!((at(0.4).rate().as_vector() - Vector3::new(0.0, -0.4, 0.0)).norm() < 1e-15);
    // There and back is nowhere.
    let nothing: RelativeMotion<Bush, Bush> = at(0.4) * at(0.4).inverse();
    assert!(nothing.velocity().as_vector().norm() < 1e-15);
    assert!(nothing.rate().as_vector().norm() < 1e-15);
}

#[test]
fn appendix_b_points_and_free_vectors_differ() {
    let c = Matrix3::new(0.0, -1.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0);
    let a_01: Transform<Bush, Cart> =
        Transform::new(Dcm::assume(c), In::assume(Vector3::new(1.0, 2.0, 3.0)));
    let a_12: Transform<Cart, Cloud> =
        Transform::new(Dcm::assume(c), In::assume(Vector3::new(0.0, 0.0, 1.0)));
    let r_c = In::<Cloud>::assume(Vector3::new(5.0, 0.0, 0.0));
    // (B.2) and (B.3) are the same.
    let stepwise = a_01.point(a_12.point(r_c));
    let at_once = (a_01 * a_12).point(r_c);
    assert_eq!(stepwise, at_once);
    assert_eq!(stepwise.as_vector(), &Vector3::new(-4.0, 2.0, 4.0));
    let free = a_01.rotation() * (a_12.rotation() * r_c);
    assert_eq!(free.as_vector(), &Vector3::new(-5.0, 0.0, 0.0));
    // And the matrix of (B.1) multiplies like the transform.
    let m = a_01.to_homogeneous() * a_12.to_homogeneous();
    assert_eq!(m, (a_01 * a_12).to_homogeneous());
    assert_eq!(
        Transform::<Bush, Cloud>::try_from_homogeneous(&m),
        Ok(a_01 * a_12)
    );
    let there_and_back = a_01 * a_01.inverse();
    assert_eq!(there_and_back, Transform::<Bush, Bush>::identity());
}

#[test]
fn sixteen_numbers_that_are_no_pose_are_refused() {
    let mut m = nalgebra::Matrix4::<f64>::identity();
    m[(3, 0)] = 0.1;
    let refuse = |m: &nalgebra::Matrix4<f64>| Transform::<Bush, Cart>::try_from_homogeneous(m);
    assert_eq!(refuse(&m), Err(TransformError::LastRow));
    m[(3, 0)] = 0.0;
    m[(1, 3)] = f64::NAN;
    assert_eq!(refuse(&m), Err(TransformError::NotFinite));
    m[(1, 3)] = 0.0;
    m[(0, 0)] = 1.1;
    assert!(matches!(refuse(&m), Err(TransformError::Rotation(_))));
}
