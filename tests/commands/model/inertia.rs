//! `strapd model inertia`.

use crate::program::strapd_fed;
use crate::shared_data::shared;
use serde_json::{Value, json};
use std::path::Path;

fn golden() -> Option<Value> {
    let path = shared("golden/inertia_golden.json")?;
    Some(serde_json::from_slice(&std::fs::read(path).unwrap()).unwrap())
}

fn answers(requests: &[Value]) -> (Vec<Value>, Option<i32>) {
    let input: String = requests.iter().map(|r| format!("{r}\n")).collect();
    let ran = strapd_fed(Path::new("."), "model inertia", input);
    (ran.lines(), ran.code)
}

fn numbers(v: &Value) -> Vec<f64> {
    match v {
        Value::Array(items) => items.iter().flat_map(numbers).collect(),
        number => vec![number.as_f64().unwrap()],
    }
}

fn close(what: &str, ours: &Value, theirs: &Value, relative: f64) {
    let (ours, theirs) = (numbers(ours), numbers(theirs));
    assert_eq!(ours.len(), theirs.len(), "{what}");
    let scale = theirs.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
    for (a, b) in ours.iter().zip(&theirs) {
        assert!((a - b).abs() <= relative * scale, "{what}: {a} is not {b}");
    }
}

#[test]
#[cfg_attr(not(has_shared), ignore = "needs ../shared (optional recordings)")]
fn every_golden_body_is_answered() {
    let Some(golden) = golden() else { return };
    let bodies = golden["bodies"].as_array().unwrap();
    let plain = |g: &Value| json!({ "mass": g["m"], "r_og_b": g["r_g"], "inertia_cg": g["I_G"], "nu": g["nu"], "tau": g["tau"] });
    let requests: Vec<Value> = bodies
        .iter()
        .flat_map(|g| {
            let mut wet = plain(g);
            wet["added_mass"] = g["M_A"].clone();
            [plain(g), wet, json!({ "m_co": g["M_CO"] })]
        })
        .collect();
    let (answers, code) = answers(&requests);
    assert_eq!((answers.len(), code), (150, Some(0)));
    for (g, found) in bodies.iter().zip(answers.chunks(3)) {
        let [dry, wet, apart] = found else { panic!() };
        for (key, theirs) in [
            ("m_cg", "M_CG"),
            ("m_co", "M_CO"),
            ("c_nu", "C_nu"),
            ("nu_dot", "nu_dot"),
            ("energy", "kinetic"),
            ("principal_moments", "principal"),
        ] {
            close(key, &dry[key], &g[theirs], 1e-12);
        }
        // A 6x6 solve loses its condition number, up to 1e2: the file's own 1e-10.
        close(
            "nu_dot",
            &wet["nu_dot"],
            &g["nu_dot_with_added_mass"],
            1e-10,
        );
        let sum: Vec<f64> = numbers(&g["C_nu"])
            .iter()
            .zip(numbers(&g["C_A_nu"]))
            .map(|(a, b)| a + b)
            .collect();
        close("c_nu", &wet["c_nu"], &json!(sum), 1e-12);
        let lost = apart["condition"]["relative_error"].as_f64().unwrap();
        assert!((2e-16..1e-12).contains(&lost), "{lost}");
        close("taken apart", &apart["inertia_cg"], &g["I_G"], 1e3 * lost);
    }
}

#[test]
#[cfg_attr(not(has_shared), ignore = "needs ../shared (optional recordings)")]
fn every_golden_composite_is_answered() {
    let Some(golden) = golden() else { return };
    let composites = golden["composites"].as_array().unwrap();
    let requests: Vec<Value> = composites
        .iter()
        .map(|g| {
            let parts = g["parts"].as_array().unwrap().iter();
            let bodies: Vec<Value> = parts
                .map(|p| json!({ "mass": p["m"], "r_og_b": p["r_g"], "inertia_cg": p["I_G"] }))
                .collect();
            json!({ "bodies": bodies })
        })
        .collect();
    let (answers, code) = answers(&requests);
    assert_eq!((answers.len(), code), (10, Some(0)));
    for (g, found) in composites.iter().zip(&answers) {
        for (key, theirs) in [
            ("mass", "m"),
            ("r_og_b", "r_g"),
            ("inertia_cg", "I_G"),
            ("m_co", "M_CO"),
        ] {
            close(key, &found[key], &g[theirs], 1e-12);
        }
    }
}

#[test]
fn the_example_of_the_seed_has_the_product_it_left_out() {
    let (found, _) = answers(&[json!({
        "mass": 1000, "r_og_b": [0.5, 0, 0.3],
        "inertia_cg": [[500, 0, 0], [0, 2000, 0], [0, 0, 2100]],
    })]);
    assert_eq!(found[0]["m_co"][3][5], -150.0);
    assert_eq!(found[0]["m_co"][5][3], -150.0);
}

#[test]
#[cfg_attr(not(has_shared), ignore = "needs ../shared (optional recordings)")]
fn what_no_matter_can_be_is_refused_by_name_and_number_and_the_run_goes_on() {
    let Some(golden) = golden() else { return };
    let mut requests: Vec<Value> = golden["invalid"]
        .as_array()
        .unwrap()
        .iter()
        .map(|g| json!({ "mass": g["m"], "inertia_cg": g["I_G"] }))
        .collect();
    let unit = json!([[1, 0, 0], [0, 1, 0], [0, 0, 1]]);
    requests.extend([
        json!({ "mass": 1, "inertia_cg": unit, "colour": "red" }),
        json!({ "mass": 1 }),
        json!({}),
        json!({ "mass": 1, "inertia_cg": unit, "bodies": [] }),
        json!({ "bodies": [] }),
        json!({ "mass": 1, "inertia_cg": unit, "tau": [0, 0, 0, 0, 0, 0] }),
        json!({ "mass": 1e300, "r_og_b": [1e300, 0, 0], "inertia_cg": unit }),
        json!({ "mass": 1, "inertia_cg": unit }),
    ]);
    let (found, code) = answers(&requests);
    assert_eq!((found.len(), code), (13, Some(3)));
    let reasons: Vec<&str> = found[..5]
        .iter()
        .map(|a| a["reason"].as_str().unwrap())
        .collect();
    assert_eq!(
        reasons,
        [
            "triangle_inequality",
            "mass_not_positive",
            "not_positive",
            "not_symmetric",
            "mass_not_positive"
        ]
    );
    for (k, word) in [
        (0, "1, 1, 3"),
        (1, "-1 kg"),
        (5, "`colour`"),
        (6, "`inertia_cg`"),
        (7, "exactly one"),
        (8, "exactly one"),
        (9, "at least one"),
        (10, "tau needs nu"),
        (11, "finite"),
    ] {
        let error = found[k]["error"].as_str().unwrap();
        assert!(error.contains(word), "{k}: {error}");
    }
    assert_eq!(found[12]["mass"], 1.0);
}
