//! What the evaluator does not run, and what an author can do about each.

use naga::{Span, TypeInner};

/// Something the evaluator does not run (storage writes, ray queries, subgroup operations, ...).
#[derive(Clone, Debug, PartialEq)]
pub struct Refused {
    /// What it is, lower case.
    pub what: String,
    /// Where, in the text that the module was parsed from.
    pub span: Span,
    /// What to write instead, as an advice.
    pub instead: &'static str,
}

impl Refused {
    pub(super) fn new(what: Unsupported, span: Span) -> Self {
        let (name, instead) = what.explained();
        Self {
            what: name.to_owned(),
            span,
            instead,
        }
    }

    /// What naga itself says of a module that it has not validated.
    pub(super) fn invalid(reason: String) -> Self {
        Self {
            what: reason,
            span: Span::UNDEFINED,
            instead: UNKNOWN,
        }
    }
}

/// What an author is told of what no shader that naga takes should have.
const UNKNOWN: &str = "write it another way; and please report it, with the shader";

/// What an author is told of what a draw does besides its picture.
const SIDE_EFFECT: &str = "give lodc the shader without it, such as behind an `#ifdef` or in an entry point of its own: levels are for what is drawn";

/// A feature of shaders that the evaluator leaves out.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Unsupported {
    Atomic,
    Barrier,
    BindingArray,
    BufferWrite,
    CooperativeMatrix,
    ExternalTexture,
    Immediate,
    ManyScalars,
    Multisampled,
    OverrideWithoutDefault,
    RayQuery,
    StorageTexture,
    StorageTextureWrite,
    Subgroup,
    TooLarge,
    Unbound,
    UnknownSize,
    Wide,
    Workgroup,
    /// What naga's validator would not have let through: the words say what it is.
    Invalid(&'static str),
}

impl Unsupported {
    /// Of a type that has no scalars.
    pub(super) fn of_type(inner: &TypeInner) -> Self {
        match inner {
            TypeInner::CooperativeMatrix { .. } => Self::CooperativeMatrix,
            TypeInner::Atomic(_) => Self::Atomic,
            TypeInner::AccelerationStructure { .. } | TypeInner::RayQuery { .. } => Self::RayQuery,
            TypeInner::BindingArray { .. } => Self::BindingArray,
            _ => Self::Invalid("a pointer or a resource inside a value"),
        }
    }

    /// What it is called, and what to do about it.
    fn explained(self) -> (&'static str, &'static str) {
        match self {
            Self::Atomic => ("an atomic operation", SIDE_EFFECT),
            Self::Barrier => ("a barrier", SIDE_EFFECT),
            Self::BindingArray => (
                "an array of bindings",
                "give each texture or buffer a variable and a binding of its own",
            ),
            Self::BufferWrite => ("a write to a buffer", SIDE_EFFECT),
            Self::CooperativeMatrix => ("a cooperative matrix", "write the products out"),
            Self::ExternalTexture => (
                "an external texture",
                "declare it as `texture_2d<f32>`, and read it with `textureSample`",
            ),
            Self::Immediate => (
                "immediate data",
                "put it into a uniform buffer, which the scene can fill",
            ),
            Self::ManyScalars => (
                "a value of more than 65536 scalars",
                "keep large tables in a texture or in a storage buffer",
            ),
            Self::Multisampled => (
                "a multisampled texture",
                "read a resolved one, a `texture_2d`",
            ),
            Self::OverrideWithoutDefault => (
                "an override without a default value",
                "give it the value that errors are to be measured with: `override name: f32 = 1.0;`",
            ),
            Self::RayQuery => (
                "a ray query",
                "give lodc the shader without it, such as behind an `#ifdef`",
            ),
            Self::StorageTexture => (
                "a storage texture",
                "read it as a sampled texture: `texture_2d<f32>`",
            ),
            Self::StorageTextureWrite => ("a write to a storage texture", SIDE_EFFECT),
            Self::Subgroup => (
                "a subgroup operation",
                "give lodc the shader without it, such as behind an `#ifdef`",
            ),
            Self::TooLarge => (
                "a program that is too large once its calls are inlined",
                "call large functions in fewer places, or in a loop",
            ),
            Self::Unbound => (
                "a resource without a binding",
                "give it one: `@group(0) @binding(0)`",
            ),
            Self::UnknownSize => (
                "an array whose size is not known",
                "give the length as a number or a `const`",
            ),
            Self::Wide => (
                "numbers of 16 or 64 bits",
                "use `f32`, `i32` and `u32` in the shader that lodc is given",
            ),
            Self::Workgroup => ("workgroup memory", SIDE_EFFECT),
            Self::Invalid(what) => (what, UNKNOWN),
        }
    }
}
