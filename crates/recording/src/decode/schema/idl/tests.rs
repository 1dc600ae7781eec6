#![allow(clippy::unwrap_used)]
use super::*;

const IMU_LIKE: &str = r#"
================================================================================
IDL: my_msgs/msg/Reading
// generated
#include "geometry_msgs/msg/Vector3.idl"
module my_msgs {
  module msg {
    typedef double double__9[9];
    module Reading_Constants { const long A = 5; };
    enum Mode { OFF, ON };
    @verbatim (language="comment", text="a \" quoted; } text" "and more")
    struct Reading {
      @unit ("rad/s") geometry_msgs::msg::Vector3 angular_velocity;
      double__9 covariance;
      sequence<octet, 16> data;
      unsigned long long stamp_ns; /* ns; */
      Mode mode;
      long double wide; float grid[2][3];
      wstring label;
      @optional long maybe;
    };
  };
};
================================================================================
IDL: geometry_msgs/msg/Vector3
module geometry_msgs { module msg { struct Vector3 { double x, y; double z; }; }; };
"#;

#[test]
fn modules_typedefs_enums_and_annotations_are_read() {
    let schema = parse(IMU_LIKE, "my_msgs/msg/Reading").unwrap();
    let root = schema.get(schema.root).unwrap();
    let shape: Vec<_> = root
        .fields
        .iter()
        .map(|f| (f.name.as_str(), f.kind, f.many))
        .collect();
    assert_eq!(
        shape,
        [
            ("angular_velocity", Kind::Struct(1), Many::One),
            ("covariance", Kind::Number(Number::F64), Many::Array(9)),
            ("data", Kind::Number(Number::U8), Many::Sequence),
            ("stamp_ns", Kind::Number(Number::U64), Many::One),
            ("mode", Kind::Number(Number::U32), Many::One),
            ("wide", Kind::Number(Number::F128), Many::One),
            ("grid", Kind::Number(Number::F32), Many::Array(6)),
            ("label", Kind::WideText, Many::One),
            ("maybe", Kind::Undefined, Many::One),
        ]
    );
    let vector: Vec<_> = schema
        .get(1)
        .unwrap()
        .fields
        .iter()
        .map(|f| f.name.as_str())
        .collect();
    assert_eq!(vector, ["x", "y", "z"]);
}

#[test]
fn what_is_not_idl_ends_with_a_sentence() {
    for text in [
        "",
        "struct",
        "struct A {",
        "struct A { long",
        "struct A { long x",
        "module m { struct A { 5 } }",
        "typedef sequence<",
        "@",
        "\"",
        "/*",
        "struct A { string<",
        "}",
    ] {
        assert!(parse(text, "a/A").is_err(), "{text}");
    }
    let circular = "typedef A B; typedef B A; struct C { A x; sequence<sequence<long>> y; };";
    let schema = parse(circular, "C").unwrap();
    assert!(
        schema.structs[0]
            .fields
            .iter()
            .all(|f| f.kind == Kind::Undefined)
    );
    let deep = format!("struct A {{ {}long x; }};", "sequence<".repeat(100_000));
    assert!(parse(&deep, "A").is_err());
}
