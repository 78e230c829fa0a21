//! [`Passes`]: those that may change a shader, lodc's own and what a program adds.
//!
//! It is a value that a [`Shader`](crate::Shader) carries, and with it every variant of that: a recipe is replayed by the passes of the
//! shader that it is replayed on.

use crate::recipe::{Declined, Pass};
use crate::{PASSES, WITH_PARAMETERS, WITH_TEXTURES, all_passes};
use std::fmt;
use std::sync::Arc;

/// The passes that may change a shader: by default lodc's own. A program adds its own with [`Self::with`]; they come behind
/// lodc's, in the order in which they were added.
#[derive(Clone, Default)]
pub struct Passes {
    added: Arc<[&'static dyn Pass]>,
}

impl Passes {
    /// These and one more. A unit struct is given as `&MyPass`, one that is made at run time by [`Box::leak`].
    ///
    /// # Errors
    /// When there is a pass of that name: a lock could not tell them apart.
    pub fn with(&self, pass: &'static dyn Pass) -> Result<Self, Declined> {
        let name = pass.name();
        if self.of_name(name).is_ok() {
            return Err(Declined(format!("there is a pass `{name}` already")));
        }
        let added = self.added.iter().copied().chain([pass]);
        Ok(Self {
            added: added.collect(),
        })
    }

    /// Those that ask nothing of the host, in the order in which candidates are listed.
    pub fn iter(&self) -> impl Iterator<Item = &'static dyn Pass> {
        PASSES.iter().chain(&*self.added).copied()
    }

    /// The same, and those that ask the host to fill a block of parameters, or to bind textures that were made for levels.
    pub fn asking(
        &self,
        parameters: bool,
        textures: bool,
    ) -> impl Iterator<Item = &'static dyn Pass> {
        let filling = WITH_PARAMETERS.iter().filter(move |_| parameters);
        let binding = WITH_TEXTURES.iter().filter(move |_| textures);
        self.iter().chain(filling.chain(binding).copied())
    }

    /// Every one.
    pub fn all(&self) -> impl Iterator<Item = &'static dyn Pass> {
        all_passes().chain(self.added.iter().copied())
    }

    /// The pass of a command-line name.
    ///
    /// # Errors
    /// When no pass has that name.
    pub fn of_name(&self, name: &str) -> Result<&'static dyn Pass, Declined> {
        self.all()
            .find(|pass| pass.name() == name)
            .ok_or_else(|| Declined(format!("there is no pass `{name}`")))
    }
}

impl fmt::Debug for Passes {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_set()
            .entries(self.all().map(|pass| pass.name()))
            .finish()
    }
}
