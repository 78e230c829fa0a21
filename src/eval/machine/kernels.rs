//! The loops that do an operation for all lanes of a block.
//!
//! A result is computed in a spare block, which then changes places with the register that it is for:
//! so an operand's register may be the result's.

use super::Registers;
use crate::eval::lane::{LANES, Lane};
use crate::eval::program::code::Register;
use lodc_passes::scalar_operations;
use lodc_passes::semantics::Op;

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

macro_rules! dispatch {
    ($(
        $(#[$doc:meta])*
        $name:ident($($operand:ident: $kind:ident),*) -> $result:ident,
        $simple:literal, $special:literal, $meaning:expr;
    )*) => {
        /// Does an operation: once when its result is uniform, else for every lane.
        #[inline(always)]
        pub(super) fn apply<R: Lane>(
            registers: &mut Registers<R>,
            op: Op,
            to: Register,
            operands: [Register; 3],
        ) {
            let r = registers;
            if to.is_uniform() {
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
                return;
            }
            match op {
                $(Op::$name => {
                    each_lane!(r operands; $result, $meaning; $($operand: $kind),*);
                    std::mem::swap(
                        &mut spare!(r, $result),
                        &mut file!(r, $result)[to.index()],
                    );
                })*
            }
        }
    };
}

scalar_operations!(dispatch);
