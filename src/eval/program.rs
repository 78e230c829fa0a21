//! Compiles an entry point of a naga module to a register program.

use naga::{Binding, Expression, Handle, Interpolation, Module, ScalarKind, Span};

/// A compiled entry point.
#[derive(Debug)]
pub struct Program {}

/// One scalar component of an entry point's input or output.
#[derive(Clone, Debug, PartialEq)]
pub struct Slot {
    /// The location or built-in that it belongs to.
    pub binding: Binding,
    /// The component, 0..4.
    pub component: usize,
    /// What its word holds.
    pub kind: ScalarKind,
    /// How it is interpolated; `None` for built-ins and for integers' `Flat`-less vertex inputs.
    pub interpolation: Option<Interpolation>,
}

/// Something the evaluator does not run (storage writes, ray queries, subgroup operations, ...).
#[derive(Clone, Debug, PartialEq)]
pub struct Refused {
    /// What it is, lower case.
    pub what: String,
    /// Where, in the text that the module was parsed from.
    pub span: Span,
}

impl Program {
    /// Compiles the entry point at `entry` of a validated module. `probes` are expressions of its
    /// function whose values are summed up while it runs (see [`super::machine::Probes`]).
    ///
    /// # Errors
    /// At the first expression or statement that the evaluator does not run.
    pub fn compile(
        module: &Module,
        entry: usize,
        probes: &[Handle<Expression>],
    ) -> Result<Self, Refused> {
        let _ = (module, entry, probes);
        Ok(Self {})
    }

    /// The scalars that each lane is given, in the order of the entry point's arguments, flattened.
    pub fn inputs(&self) -> &[Slot] {
        &[]
    }

    /// The scalars that each lane returns, in the order of the result, flattened.
    pub fn outputs(&self) -> &[Slot] {
        &[]
    }

    /// Whether a lane may be discarded.
    pub fn discards(&self) -> bool {
        false
    }
}
