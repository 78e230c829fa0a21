//! Runs the parameter stage of a variant, or of a text that was emitted, and binds what it computes as the block that its other stages read.

use super::lane::{LANES, Mask};
use super::machine::{Bindings, Machine, Resource};
use super::program::{Program, Refused};
use crate::front::filled::Filled;
use lodc_passes::{Shader, parameters};
use naga::{Binding, GlobalVariable, Handle, Module, TypeInner};
use std::sync::Arc;

/// Uniform buffers are bound in whole vectors of four.
const ROUNDED: usize = 16;

/// The parameter stage of a variant, compiled.
#[derive(Debug)]
pub struct ParameterStage {
    /// Returns the members of the block.
    program: Program,
    /// For each word that it returns, where in the block it goes, in bytes.
    offsets: Vec<usize>,
    /// Of the block, in bytes.
    size: usize,
    /// The group and binding that the other stages read it at.
    at: (u32, u32),
}

impl ParameterStage {
    /// That of a variant; nothing for one without parameters.
    ///
    /// # Errors
    /// When the evaluator refuses it; a variant of an original that runs, runs.
    pub fn of(shader: &Shader) -> Result<Option<Self>, Refused> {
        let (Some(block), Some((module, entry))) =
            (shader.parameter_block(), shader.parameters_returned())
        else {
            return Ok(None);
        };
        Self::returned(shader.module(), &module, entry, block.read)
    }

    /// That of a uniform which a text fills itself; nothing where the entry point that does has another end.
    ///
    /// # Errors
    /// When the evaluator refuses the entry point.
    pub(crate) fn of_text(module: &Module, filled: &Filled) -> Result<Option<Self>, Refused> {
        match parameters::returned(module, filled.entry, filled.stored) {
            Some(returned) => Self::returned(module, &returned, filled.entry, filled.read),
            None => Ok(None),
        }
    }

    /// That whose entry point returns the members of a uniform of the module.
    fn returned(
        module: &Module,
        returned: &Module,
        entry: usize,
        read: Handle<GlobalVariable>,
    ) -> Result<Option<Self>, Refused> {
        let variable = &module.global_variables[read];
        let (Some(binding), TypeInner::Struct { members, span }) =
            (&variable.binding, &module.types[variable.ty].inner)
        else {
            return Ok(None);
        };
        let program = Program::compile(returned, entry, &[])?;
        let offsets = program.outputs().iter().map(|slot| match slot.binding {
            Binding::Location { location, .. } => {
                members[location as usize].offset as usize + 4 * slot.component
            }
            Binding::BuiltIn(_) => 0,
        });
        Ok(Some(Self {
            offsets: offsets.collect(),
            size: (*span as usize).next_multiple_of(ROUNDED),
            at: (binding.group, binding.binding),
            program,
        }))
    }

    /// The block for each of so many draws with these resources, and the work of a draw.
    pub fn blocks(&self, bindings: &Bindings, draws: usize) -> (Vec<Vec<u8>>, f64) {
        let mut first = Mask::default();
        first.0[0] = 1;
        let mut outputs = vec![[0; LANES]; self.offsets.len()];
        let mut work = 0.0;
        let blocks = (0..draws).map(|draw| {
            let mut machine = Machine::of_draw(&self.program, bindings, draw);
            machine.run(&[], first, first, &mut outputs);
            work += machine.profile().work.total();
            let mut block = vec![0; self.size];
            for (offset, output) in self.offsets.iter().zip(&outputs) {
                block[*offset..offset + 4].copy_from_slice(&output[0].to_le_bytes());
            }
            block
        });
        let blocks = blocks.collect();
        (blocks, work / draws.max(1) as f64)
    }

    /// Binds the block of each of so many draws beside their other resources. Returns the work of all draws, in full-rate
    /// scalar operations.
    pub fn bind(&self, bindings: &mut Bindings, draws: usize) -> f64 {
        let (blocks, work) = self.blocks(bindings, draws);
        let buffer = |block| Resource::Buffer(Arc::new(block));
        let resource = Resource::PerDraw(blocks.into_iter().map(buffer).collect());
        bindings.insert(self.at, resource);
        work * draws as f64
    }
}
