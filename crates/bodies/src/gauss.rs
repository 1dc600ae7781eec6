//! Gauss-Legendre quadrature with eight points. Pure.

/// Positive nodes and their weights on (-1, 1).
pub(crate) const NODES: [(f64, f64); 4] = [
    (0.183_434_642_495_649_8, 0.362_683_783_378_362),
    (0.525_532_409_916_329, 0.313_706_645_877_887_3),
    (0.796_666_477_413_626_7, 0.222_381_034_453_374_48),
    (0.960_289_856_497_536_3, 0.101_228_536_290_376_26),
];

/// Calls `at(seconds since the start, weight in s)` for every point of `pieces` equal parts of `whole`
/// seconds.
pub(crate) fn gauss(whole: f64, pieces: u32, mut at: impl FnMut(f64, f64)) {
    let half = 0.5 * whole / f64::from(pieces);
    for piece in 0..pieces {
        let middle = half * (2.0 * f64::from(piece) + 1.0);
        for (node, weight) in NODES {
            at(middle - half * node, half * weight);
            at(middle + half * node, half * weight);
        }
    }
}
