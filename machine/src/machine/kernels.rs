//! The loops that do an operation for all lanes of a block.
//!
//! A result is computed in a spare block, which then changes places with the register that it is for:
//! so an operand's register may be the result's.

use crate::lane::{LANES, Words};
use crate::program::code::Register;
use lodc_passes::scalar_operations;
use lodc_passes::semantics::{Kind, Op, Real};

/// The registers of a machine.
#[derive(Debug)]
pub struct Registers<R> {
    pub(super) floats: Vec<Box<[R; LANES]>>,
    pub(super) words: Vec<Box<Words>>,
    pub(super) uniform_floats: Vec<R>,
    pub(super) uniform_words: Vec<u32>,
    /// Takes a result before it changes places with its register.
    pub(super) spare_float: Box<[R; LANES]>,
    pub(super) spare_word: Box<Words>,
}

impl<R: Real> Registers<R> {
    /// Registers for `[varying floats, varying words, uniform floats, uniform words]`, all 0.
    pub(super) fn new([floats, words, uniform_floats, uniform_words]: [u32; 4]) -> Self {
        Self {
            floats: vec![Box::new([R::default(); LANES]); floats as usize],
            words: vec![Box::new([0; LANES]); words as usize],
            uniform_floats: vec![R::default(); uniform_floats as usize],
            uniform_words: vec![0; uniform_words as usize],
            spare_float: Box::new([R::default(); LANES]),
            spare_word: Box::new([0; LANES]),
        }
    }
}

/// Shows that the processor has the vectors that the loops are compiled for: AVX2 on x86-64, whatever there is
/// elsewhere. Rust fuses no operations, so the bits do not depend on it.
#[derive(Clone, Copy, Debug)]
pub struct Vectors(());

impl Vectors {
    /// Asks the processor.
    pub(super) fn detect() -> Option<Self> {
        #[cfg(target_arch = "x86_64")]
        if !std::arch::is_x86_feature_detected!("avx2") {
            return None;
        }
        Some(Self(()))
    }
}

/// A type of lane that has loops.
pub trait Kernels: Real {
    /// Does an operation for every lane.
    fn apply(
        vectors: Option<Vectors>,
        registers: &mut Registers<Self>,
        op: Op,
        to: Register,
        operands: [Register; 3],
    );
}

/// The file of varying registers of a kind.
macro_rules! file {
    ($registers:ident, F) => {
        $registers.floats
    };
    ($registers:ident, W) => {
        $registers.words
    };
}
macro_rules! uniform_file {
    ($registers:ident, F) => {
        $registers.uniform_floats
    };
    ($registers:ident, W) => {
        $registers.uniform_words
    };
}
macro_rules! spare {
    ($registers:ident, F) => {
        $registers.spare_float
    };
    ($registers:ident, W) => {
        $registers.spare_word
    };
}
macro_rules! number {
    (F) => {
        R
    };
    (W) => {
        u32
    };
}

/// Fills the spare block with the meaning of an operation: a loop for each way in which operands
/// vary or are uniform. Not all are uniform.
macro_rules! each_lane {
    ($r:ident $ops:ident; $result:ident, $meaning:expr; $a:ident: $ka:ident) => {{
        let x = &*file!($r, $ka)[$ops[0].index()];
        let out = &mut *spare!($r, $result);
        for i in 0..LANES {
            let $a = x[i];
            out[i] = $meaning;
        }
    }};
    ($r:ident $ops:ident; $result:ident, $meaning:expr; $a:ident: $ka:ident, $b:ident: $kb:ident) => {{
        let out = &mut *spare!($r, $result);
        if $ops[0].is_uniform() {
            let $a = uniform_file!($r, $ka)[$ops[0].index()];
            let y = &*file!($r, $kb)[$ops[1].index()];
            for i in 0..LANES {
                let $b = y[i];
                out[i] = $meaning;
            }
        } else if $ops[1].is_uniform() {
            let x = &*file!($r, $ka)[$ops[0].index()];
            let $b = uniform_file!($r, $kb)[$ops[1].index()];
            for i in 0..LANES {
                let $a = x[i];
                out[i] = $meaning;
            }
        } else {
            let x = &*file!($r, $ka)[$ops[0].index()];
            let y = &*file!($r, $kb)[$ops[1].index()];
            for i in 0..LANES {
                let ($a, $b) = (x[i], y[i]);
                out[i] = $meaning;
            }
        }
    }};
    ($r:ident $ops:ident; $result:ident, $meaning:expr; $a:ident: $ka:ident, $b:ident: $kb:ident, $c:ident: $kc:ident) => {{
        // Uniform operands of the rarer ways are spread over a block first.
        let (ua, ub, uc) = (
            $ops[0].is_uniform(),
            $ops[1].is_uniform(),
            $ops[2].is_uniform(),
        );
        let out = &mut *spare!($r, $result);
        if ub && uc {
            let x = &*file!($r, $ka)[$ops[0].index()];
            let $b = uniform_file!($r, $kb)[$ops[1].index()];
            let $c = uniform_file!($r, $kc)[$ops[2].index()];
            for i in 0..LANES {
                let $a = x[i];
                out[i] = $meaning;
            }
        } else if ua && ub {
            let $a = uniform_file!($r, $ka)[$ops[0].index()];
            let $b = uniform_file!($r, $kb)[$ops[1].index()];
            let z = &*file!($r, $kc)[$ops[2].index()];
            for i in 0..LANES {
                let $c = z[i];
                out[i] = $meaning;
            }
        } else {
            let spread: [number!($ka); LANES];
            let x: &[number!($ka); LANES] = if ua {
                spread = [uniform_file!($r, $ka)[$ops[0].index()]; LANES];
                &spread
            } else {
                &file!($r, $ka)[$ops[0].index()]
            };
            let spread: [number!($kb); LANES];
            let y: &[number!($kb); LANES] = if ub {
                spread = [uniform_file!($r, $kb)[$ops[1].index()]; LANES];
                &spread
            } else {
                &file!($r, $kb)[$ops[1].index()]
            };
            if uc {
                let $c = uniform_file!($r, $kc)[$ops[2].index()];
                for i in 0..LANES {
                    let ($a, $b) = (x[i], y[i]);
                    out[i] = $meaning;
                }
            } else {
                let z = &*file!($r, $kc)[$ops[2].index()];
                for i in 0..LANES {
                    let ($a, $b, $c) = (x[i], y[i], z[i]);
                    out[i] = $meaning;
                }
            }
        }
    }};
}

/// The operations without loops of their own.
macro_rules! singly {
    ($(
        $(#[$doc:meta])*
        $name:ident($($operand:ident: $kind:ident),*) -> $result:ident,
        $simple:literal, $special:literal, $meaning:expr;
    )*) => {
        /// Does an operation whose operands are all uniform.
        pub(super) fn once<R: Real>(
            r: &mut Registers<R>,
            op: Op,
            to: Register,
            operands: [Register; 3],
        ) {
            match op {
                $(Op::$name => {
                    let mut at = 0;
                    $(
                        let $operand = uniform_file!(r, $kind)[operands[at].index()];
                        at += 1;
                    )*
                    let _ = at;
                    uniform_file!(r, $result)[to.index()] = $meaning;
                })*
            }
        }

        /// Does an operation for every lane, one after the other.
        fn one_by_one<R: Real>(
            r: &mut Registers<R>,
            op: Op,
            to: Register,
            operands: [Register; 3],
        ) {
            for i in 0..LANES {
                match op {
                    $(Op::$name => {
                        let mut at = 0;
                        $(
                            let register = operands[at];
                            let $operand = if register.is_uniform() {
                                uniform_file!(r, $kind)[register.index()]
                            } else {
                                file!(r, $kind)[register.index()][i]
                            };
                            at += 1;
                        )*
                        let _ = at;
                        spare!(r, $result)[i] = $meaning;
                    })*
                }
            }
            match op.signature().1 {
                Kind::F => std::mem::swap(&mut r.spare_float, &mut r.floats[to.index()]),
                Kind::W => std::mem::swap(&mut r.spare_word, &mut r.words[to.index()]),
            }
        }
    };
}
scalar_operations!(singly);

/// The loops for the type of lane `R`: a function for each operation, so that each is small enough for the
/// compiler.
macro_rules! loops {
    ($(
        $(#[$doc:meta])*
        $name:ident($($operand:ident: $kind:ident),*) -> $result:ident,
        $simple:literal, $special:literal, $meaning:expr;
    )*) => {
        $(
            #[inline(never)]
            #[cfg_attr(target_arch = "x86_64", target_feature(enable = "avx2"))]
            fn $name(r: &mut Registers<R>, to: Register, operands: [Register; 3]) {
                each_lane!(r operands; $result, $meaning; $($operand: $kind),*);
                std::mem::swap(&mut spare!(r, $result), &mut file!(r, $result)[to.index()]);
            }
        )*

        #[cfg_attr(target_arch = "x86_64", target_feature(enable = "avx2"))]
        pub(super) fn apply(
            r: &mut Registers<R>,
            op: Op,
            to: Register,
            operands: [Register; 3],
        ) {
            match op {
                $(Op::$name => $name(r, to, operands),)*
            }
        }
    };
}

#[allow(non_snake_case, reason = "functions are named after operations")]
mod of_f32 {
    use super::{LANES, Op, Register, Registers, scalar_operations};

    type R = f32;
    scalar_operations!(loops);
}

impl Kernels for f32 {
    fn apply(
        vectors: Option<Vectors>,
        registers: &mut Registers<Self>,
        op: Op,
        to: Register,
        operands: [Register; 3],
    ) {
        match vectors {
            #[cfg(target_arch = "x86_64")]
            // SAFETY: `Vectors` are only made where `is_x86_feature_detected!` has found AVX2.
            Some(Vectors(())) => unsafe { of_f32::apply(registers, op, to, operands) },
            #[cfg(not(target_arch = "x86_64"))]
            Some(Vectors(())) => of_f32::apply(registers, op, to, operands),
            None => one_by_one(registers, op, to, operands),
        }
    }
}

impl Kernels for crate::shadow::Both {
    fn apply(
        _: Option<Vectors>,
        registers: &mut Registers<Self>,
        op: Op,
        to: Register,
        operands: [Register; 3],
    ) {
        one_by_one(registers, op, to, operands);
    }
}
