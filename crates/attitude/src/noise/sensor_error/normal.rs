//! A seed -> independent streams of normal numbers, the same bits on every platform. Pure.
//!
//! Bits: ChaCha with 8 rounds, one key per seed and one of its 2^64 streams per term and axis, so
//! that no term's draws depend on another term, and none on the order in which they are drawn.
//! Numbers: the ziggurat with 256 layers. Its tables and its rare paths use the `libm` crate; all
//! else is comparison, multiplication and addition, so nothing depends on the platform.
//!
//! # Source
//! G. Marsaglia and W. W. Tsang, "The ziggurat method for generating random variables", 2000, in
//! the form of J. A. Doornik, "An improved ziggurat method to generate normal random samples",
//! 2005: layer and abscissa come from different bits.

use nalgebra::Vector3;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};
use std::sync::LazyLock;

/// Beginning of the tail, for 256 layers.
const TAIL: f64 = 3.654_152_885_361_009;

/// Right edges of the layers and the density there, bottom layer first.
struct Layers {
    edge: [f64; 257],
    density: [f64; 257],
}

static LAYERS: LazyLock<Layers> = LazyLock::new(|| {
    let density = |x: f64| libm::exp(-0.5 * x * x);
    // The area of every layer: the bottom one is a rectangle and the tail.
    let area = TAIL * density(TAIL)
        + (0.5 * std::f64::consts::PI).sqrt() * libm::erfc(TAIL * std::f64::consts::FRAC_1_SQRT_2);
    let mut edge = [0.0; 257];
    edge[0] = area / density(TAIL);
    edge[1] = TAIL;
    for i in 1..255 {
        edge[i + 1] = (-2.0 * libm::log(area / edge[i] + density(edge[i]))).sqrt();
    }
    Layers {
        edge,
        density: edge.map(density),
    }
});

/// One stream of uniform and standard normal numbers.
#[derive(Clone)]
pub(super) struct Stream {
    bits: ChaCha8Rng,
    layers: &'static Layers,
}

impl std::fmt::Debug for Stream {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_tuple("Stream")
            .field(&self.bits.get_stream())
            .finish()
    }
}

/// Purpose of a stream. The numbers are part of what a seed means: never renumber.
#[derive(Clone, Copy, Debug)]
pub(super) enum Purpose {
    White = 1,
    Flicker = 2,
    GaussMarkov = 3,
    RandomWalk = 4,
    Acceleration = 5,
    TurnOnBias = 6,
    TemperatureCoefficient = 7,
    Scale = 8,
    Misalignment = 9,
    Nonlinearity = 10,
    Nonlinearity3 = 11,
    GSensitivity = 12,
    AccelerationBias = 13,
    SamplingJitter = 14,
    StampJitter = 15,
    Drops = 16,
    AccelerationScale = 17,
    AccelerationMisalignment = 18,
    MagneticNoise = 19,
    HardIron = 20,
    SoftIron = 21,
}

impl Stream {
    /// The stream of one purpose and axis (0 to 2).
    pub(super) fn new(seed: u64, purpose: Purpose, axis: u64) -> Stream {
        let mut key = *b"--------strapd sensor errors v1.";
        key[..8].copy_from_slice(&seed.to_le_bytes());
        let mut bits = ChaCha8Rng::from_seed(key);
        bits.set_stream(4 * purpose as u64 + axis);
        Stream {
            bits,
            layers: &LAYERS,
        }
    }

    /// The streams of the three axes.
    pub(super) fn axes(seed: u64, purpose: Purpose) -> [Stream; 3] {
        [0, 1, 2].map(|axis| Stream::new(seed, purpose, axis))
    }

    /// Uniform on (0, 1].
    pub(super) fn uniform(&mut self) -> f64 {
        ((self.bits.next_u64() >> 11) + 1) as f64 * (1.0 / (1u64 << 53) as f64)
    }

    /// Standard normal.
    #[inline]
    pub(super) fn normal(&mut self) -> f64 {
        let bits = self.bits.next_u64();
        let layer = (bits & 255) as usize;
        // The upper 53 bits, signed: in [-1, 1).
        let u = (bits.cast_signed() >> 11) as f64 * (1.0 / (1u64 << 52) as f64);
        let x = u * self.layers.edge[layer];
        if x.abs() < self.layers.edge[layer + 1] {
            return x;
        }
        self.outside(layer, x)
    }

    /// The one draw in a hundred that falls outside a layer's rectangle.
    #[cold]
    fn outside(&mut self, mut layer: usize, mut x: f64) -> f64 {
        loop {
            if layer == 0 {
                return self.tail().copysign(x);
            }
            let (low, high) = (self.layers.density[layer], self.layers.density[layer + 1]);
            if low + self.uniform() * (high - low) < libm::exp(-0.5 * x * x) {
                return x;
            }
            let bits = self.bits.next_u64();
            layer = (bits & 255) as usize;
            let u = (bits.cast_signed() >> 11) as f64 * (1.0 / (1u64 << 52) as f64);
            x = u * self.layers.edge[layer];
            if x.abs() < self.layers.edge[layer + 1] {
                return x;
            }
        }
    }

    /// Beyond [`TAIL`] (Marsaglia 1964).
    fn tail(&mut self) -> f64 {
        loop {
            let beyond = -libm::log(self.uniform()) / TAIL;
            if -2.0 * libm::log(self.uniform()) >= beyond * beyond {
                return TAIL + beyond;
            }
        }
    }
}

/// One standard normal number from each axis's stream.
#[inline]
pub(super) fn vector(streams: &mut [Stream; 3]) -> Vector3<f64> {
    let [x, y, z] = streams;
    Vector3::new(x.normal(), y.normal(), z.normal())
}
