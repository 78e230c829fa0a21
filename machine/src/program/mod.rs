//! Compiles an entry point of a naga module to a register program.
//!
//! ```text
//! Module --lower--> Ir       scalars, calls inlined, stores forwarded
//! Ir --simplify--> Ir        what nothing reads is gone
//! Ir --uniform--> Uniformity what is the same for all lanes
//! Ir --registers--> Code     what a Machine runs
//! ```

pub(super) mod code;
pub(super) mod executed;
mod expression;
mod ir;
mod lower;
mod opacity;
mod refused;
mod registers;
mod simplify;
mod uniform;

pub use opacity::Opacity;
pub use refused::Refused;

use crate::mix::Mix;
use executed::Executed;
use lodc_passes::Work;
use naga::{
    Binding, Expression, FunctionArgument, FunctionResult, Handle, Interpolation, Module,
    ScalarKind, Span, TypeInner,
};

/// A compiled entry point.
#[derive(Debug)]
pub struct Program {
    pub(super) code: code::Code,
    inputs: Vec<Slot>,
    outputs: Vec<Slot>,
    discards: bool,
    /// What a lane that is counted has worked, by count.
    pub(super) work: Vec<Work>,
    /// The same by class.
    pub(super) executed: Vec<Executed>,
    /// What every lane executes of the prologue.
    pub(super) prologue: Mix,
    pub(super) buffers: Vec<(u32, u32)>,
    pub(super) textures: Vec<(u32, u32)>,
    pub(super) samplers: Vec<(u32, u32)>,
    /// The components of each probe.
    pub(super) probes: Vec<usize>,
    /// Where the loop of each label is.
    pub(super) loops: Vec<(u32, Span)>,
    /// The components of each probe of a value beside an operand.
    pub(super) pairs: Vec<usize>,
}

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

impl Slot {
    /// Whether what is handed over here arrives there: at the same component of the same location or built-in.
    pub fn meets(&self, other: &Self) -> bool {
        self.component == other.component
            && match (&self.binding, &other.binding) {
                (Binding::Location { location: a, .. }, Binding::Location { location: b, .. }) => {
                    a == b
                }
                (a, b) => a == b,
            }
    }
}

impl Program {
    /// Compiles the entry point at `entry` of a validated module. `probes` are expressions of its
    /// function whose values are summed up while it runs (see [`super::machine::Profile`]); one that
    /// does not hold floats has no components there.
    ///
    /// # Errors
    /// At the first expression or statement that the evaluator does not run.
    ///
    /// # Panics
    /// When there is no such entry point.
    pub fn compile(
        module: &Module,
        entry: usize,
        probes: &[Handle<Expression>],
    ) -> Result<Self, Refused> {
        Self::compile_with_pairs(module, entry, probes, &[])
    }

    /// What the opacity of an entry point's fragments is made of, among such probes and the textures. Where fragments
    /// are `blended`, their alpha at location 0 is seen; what decides about a discard always is.
    ///
    /// # Errors
    /// As [`compile`](Self::compile).
    ///
    /// # Panics
    /// As [`compile`](Self::compile).
    pub fn opacity(
        module: &Module,
        entry: usize,
        probes: &[Handle<Expression>],
        pairs: &[(Handle<Expression>, Handle<Expression>)],
        blended: bool,
    ) -> Result<Opacity, Refused> {
        let entry = &module.entry_points[entry];
        let ir = lower::Lowering::run(module, entry, probes, pairs)?;
        let slots = outputs(module, entry.function.result.as_ref());
        let seen = slots
            .iter()
            .zip(&ir.outputs)
            .filter(|(slot, _)| match slot.binding {
                Binding::Location {
                    location: 0,
                    blend_src: None | Some(0),
                    ..
                } => blended && slot.component == 3,
                Binding::BuiltIn(built_in) => built_in == naga::BuiltIn::SampleMask,
                Binding::Location { .. } => false,
            });
        Ok(Opacity::of(&ir, seen.map(|(_, (value, _))| *value)))
    }

    /// The same with probes of values beside an operand of theirs, which has as many components or one.
    ///
    /// # Errors
    /// As [`compile`](Self::compile).
    ///
    /// # Panics
    /// As [`compile`](Self::compile).
    pub fn compile_with_pairs(
        module: &Module,
        entry: usize,
        probes: &[Handle<Expression>],
        pairs: &[(Handle<Expression>, Handle<Expression>)],
    ) -> Result<Self, Refused> {
        let function = &module.entry_points[entry].function;
        let mut ir = lower::Lowering::run(module, &module.entry_points[entry], probes, pairs)?;
        simplify::simplify(&mut ir);
        let homes = uniform::Homes::of(&ir);
        let uniformity = uniform::analyse(&ir, &homes);
        let (executed, prologue) = executed::executed(&ir, &uniformity);
        Ok(Self {
            code: registers::write(&ir, &homes, &uniformity),
            inputs: inputs(module, &function.arguments),
            outputs: outputs(module, function.result.as_ref()),
            discards: ir.discards,
            work: ir.work,
            executed,
            prologue,
            buffers: ir.buffers,
            textures: ir.textures,
            samplers: ir.samplers,
            probes: ir.probes,
            loops: ir.loops,
            pairs: ir.pairs,
        })
    }

    /// The scalars that each lane is given, in the order of the entry point's arguments, flattened.
    pub fn inputs(&self) -> &[Slot] {
        &self.inputs
    }

    /// The same, of those that it reads.
    pub fn read_inputs(&self) -> impl Iterator<Item = &Slot> {
        let read = self.inputs.iter().zip(&self.code.inputs);
        read.filter_map(|(slot, read)| read.is_some().then_some(slot))
    }

    /// The scalars that each lane returns, in the order of the result, flattened.
    pub fn outputs(&self) -> &[Slot] {
        &self.outputs
    }

    /// Whether a lane may be discarded.
    pub fn discards(&self) -> bool {
        self.discards
    }
}

fn inputs(module: &Module, arguments: &[FunctionArgument]) -> Vec<Slot> {
    let mut slots = Vec::new();
    for argument in arguments {
        let inner = &module.types[argument.ty].inner;
        slots_of(module, inner, argument.binding.as_ref(), &mut slots);
    }
    slots
}

fn outputs(module: &Module, result: Option<&FunctionResult>) -> Vec<Slot> {
    let mut slots = Vec::new();
    if let Some(result) = result {
        let inner = &module.types[result.ty].inner;
        slots_of(module, inner, result.binding.as_ref(), &mut slots);
    }
    slots
}

fn slots_of(module: &Module, inner: &TypeInner, binding: Option<&Binding>, slots: &mut Vec<Slot>) {
    match (inner, binding) {
        (TypeInner::Struct { members, .. }, None) => {
            for member in members {
                let inner = &module.types[member.ty].inner;
                slots_of(module, inner, member.binding.as_ref(), slots);
            }
        }
        (_, Some(binding)) => {
            let first = slots.len();
            leaves(module, inner, &mut |kind| {
                slots.push(Slot {
                    binding: binding.clone(),
                    component: slots.len() - first,
                    kind,
                    interpolation: match binding {
                        Binding::Location { interpolation, .. } => *interpolation,
                        Binding::BuiltIn(_) => None,
                    },
                });
            });
        }
        (_, None) => {}
    }
}

/// Calls `visit` with the kind of each scalar.
fn leaves(module: &Module, inner: &TypeInner, visit: &mut impl FnMut(ScalarKind)) {
    match inner {
        TypeInner::Scalar(scalar) => visit(scalar.kind),
        TypeInner::Vector { size, scalar } => (0..*size as u32).for_each(|_| visit(scalar.kind)),
        TypeInner::Array {
            base,
            size: naga::ArraySize::Constant(size),
            ..
        } => (0..size.get()).for_each(|_| leaves(module, &module.types[*base].inner, visit)),
        _ => {}
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lane::{LANES, Mask, Words};
    use crate::machine::{Bindings, Machine};

    /// The register of `!c` was that of a sum before, and still is in the lanes that do not ask for `c`.
    #[test]
    fn a_condition_in_the_register_of_a_number() {
        let source = "
            var<private> asked: i32;
            fn ask(answer: bool) -> bool { asked += 1; return answer; }
            fn ask_early(x: f32) -> bool {
                if x > 0.7 { asked += 10; return true; }
                return ask(x > 0.3);
            }
            @fragment
            fn fs_main(@location(0) x: f32, @location(1) y: f32) -> @location(0) vec2f {
                let left = x > 0.5;
                let right = y > 0.5;
                var c = left;
                if left || ask(right) {
                    c = ask_early(y);
                    if !c { asked += 100; }
                }
                return vec2f(f32(asked), select(0.0, 1.0, c));
            }";
        let module = naga::front::wgsl::parse_str(source).expect("it is valid");
        let program = Program::compile(&module, 0, &[]).expect("it is run");
        let place = |lane: usize| [lane % 16, lane / 16].map(|i| (i as f32 + 0.5) / 16.0);
        let inputs: [Words; 2] =
            [0, 1].map(|c| std::array::from_fn(|lane| place(lane)[c].to_bits()));
        let mut outputs = [[0; LANES]; 2];
        let bindings = Bindings::new();
        Machine::new(&program, &bindings).run(&inputs, Mask::ALL, Mask::ALL, &mut outputs);
        let found = |lane: usize| [0, 1].map(|i: usize| f32::from_bits(outputs[i][lane]));
        for lane in 0..LANES {
            let [x, y] = place(lane);
            let mut asked = if x > 0.5 { 0.0 } else { 1.0 };
            let mut c = false;
            if x > 0.5 || y > 0.5 {
                c = y > 0.3;
                asked += if y > 0.7 { 10.0 } else { 1.0 };
                asked += if c { 0.0 } else { 100.0 };
            }
            assert_eq!(found(lane), [asked, f32::from(u8::from(c))], "at {x}, {y}");
        }
    }
}
