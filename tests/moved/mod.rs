//! Shaders with all that can be done once a draw moved to parameters, and emitted; and uniforms for them at random.
#![allow(
    dead_code,
    reason = "every test takes what it needs of a shared module"
)]

use lodc::compile::normal_form;
use lodc::emit::{self, EmitLevel, Files, Output};
use lodc::front::Source;
use lodc_passes::to_parameter::ToParameter;
use lodc_passes::{Facts, Pass, Shader};
use std::path::Path;

/// A shader with all that can be moved to parameters exactly, and the files of it as the one level of what it was.
pub(crate) fn with_parameters(path: &Path) -> (Shader, Files) {
    let source = Source::read(path).unwrap_or_else(|e| panic!("{e}"));
    let base = normal_form(&source).unwrap_or_else(|e| panic!("{e}"));
    let mut shader = base.clone();
    while let Some(candidate) = ToParameter.candidates(&shader, &Facts::default()).first() {
        shader = ToParameter.apply(&shader, candidate);
    }
    let level = EmitLevel {
        autolod: 1.0,
        shader: shader.clone(),
        distance: 1.0,
        error: 0.0,
        cost: 1.0,
        time: None,
        says: "a variant".into(),
    };
    let files = emit::emit(&source, &base, &[level], Output::default());
    (shader, files.unwrap_or_else(|e| panic!("{e}")))
}

/// Numbers at random, the same on every run.
pub(crate) struct Chance(pub(crate) u64);

impl Chance {
    fn next(&mut self) -> u32 {
        self.0 = self
            .0
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1);
        (self.0 >> 32) as u32
    }

    /// A float: most are ordinary, and some are what is easily got wrong.
    fn float(&mut self) -> u32 {
        let awkward = [
            0.0,
            -0.0,
            1.0,
            -1.0,
            0.5,
            2.5,
            -3.5,
            1e-40,
            3.0,
            1e-6,
            7e5,
            1e38,
            -1e30,
            f32::INFINITY,
        ];
        self.one_of(&awkward)
    }

    /// The same of floats that are as large as an angle may be.
    fn angle(&mut self) -> u32 {
        let awkward = [0.0, -0.0, 1.0, -1.0, 0.5, 2.5, -3.5, 1e-40, 3.0, 1e-6, 7e5];
        self.one_of(&awkward)
    }

    fn one_of(&mut self, awkward: &[f32]) -> u32 {
        let ordinary = (self.next() >> 8) as f32 / (1 << 21) as f32 - 4.0;
        let pick = self.next() as usize % (awkward.len() * 6);
        awkward.get(pick).copied().unwrap_or(ordinary).to_bits()
    }

    /// An integer: most are small, and some have any bits.
    fn integer(&mut self) -> u32 {
        let awkward = [0, u32::MAX, i32::MIN as u32, 31, 32, 33];
        match self.next() % 16 {
            0 => self.next(),
            1 => awkward[self.next() as usize % awkward.len()],
            2..6 => 0u32.wrapping_sub(self.next() % 9),
            _ => self.next() % 9,
        }
    }

    /// So many words: `f` for a float, `a` for one that may be an angle, `o` for an ordinary one, else an integer.
    pub(crate) fn words(&mut self, kinds: &str) -> Vec<u32> {
        let word = |kind| match kind {
            'f' => self.float(),
            'a' => self.angle(),
            'o' => self.one_of(&[1.0, 0.5, 2.5, -3.5]),
            _ => self.integer(),
        };
        kinds.chars().map(word).collect()
    }
}

/// A structure with these words.
pub(crate) fn of_words<T: Copy>(words: &[u32]) -> T {
    assert_eq!(size_of::<T>(), 4 * words.len());
    // SAFETY: the structures here are of f32, i32 and u32 alone, without gaps, so that any words are one; the size is
    // that of the words.
    unsafe { words.as_ptr().cast::<T>().read_unaligned() }
}

/// Words as a buffer has them.
pub(crate) fn bytes(words: &[u32]) -> Vec<u8> {
    words.iter().flat_map(|word| word.to_le_bytes()).collect()
}

/// Numbers between two of the same kind, in units in the last place; those that are not numbers are alike.
pub(crate) fn apart(a: u32, b: u32) -> u32 {
    let ordered = |bits: u32| match bits as i32 {
        x if x < 0 => i32::MIN.wrapping_sub(x),
        x => x,
    };
    let [x, y] = [a, b].map(f32::from_bits);
    match x.is_nan() && y.is_nan() {
        true => 0,
        false => ordered(a).abs_diff(ordered(b)),
    }
}
