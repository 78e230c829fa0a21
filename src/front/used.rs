//! Which parts of a buffer the chosen entry points may read, and those that fill a uniform of theirs: the others need no
//! value.

use super::Source;
use naga::valid::{FunctionInfo, ModuleInfo};
use naga::{Expression, Function, GlobalVariable, Handle, Module};
use std::collections::{BTreeMap, BTreeSet};

/// Which members of a buffer's struct the chosen entry points may read.
#[derive(Debug, PartialEq)]
pub(crate) enum Used {
    Nothing,
    All,
    /// The names of the variable's members.
    Members(BTreeSet<String>),
}

impl Used {
    pub(crate) fn of(source: &Source, handle: Handle<GlobalVariable>) -> Self {
        let entries = [
            Some(source.fragment_entry().0),
            source.vertex_entry().map(|(i, _)| i),
        ];
        let filling = source.filled().into_iter().map(|filled| filled.entry);
        let reached = |i: usize| !source.info.get_entry_point(i)[handle].is_empty();
        if !entries.into_iter().flatten().chain(filling).any(reached) {
            return Self::Nothing;
        }
        let variable = &source.module.global_variables[handle];
        let naga::TypeInner::Struct { members, .. } = &source.module.types[variable.ty].inner
        else {
            return Self::All;
        };
        let mut names = BTreeSet::new();
        for (function, info) in functions(&source.module, &source.info) {
            // Each mention of the variable is an expression of its own.
            let mut mentions = BTreeMap::new();
            for (pointer, expression) in function.expressions.iter() {
                if matches!(expression, Expression::GlobalVariable(g) if *g == handle) {
                    mentions.insert(pointer, 0);
                }
            }
            for (place, expression) in function.expressions.iter() {
                if let Expression::AccessIndex { base, index } = expression
                    && let Some(parts) = mentions.get_mut(base)
                {
                    *parts += 1;
                    // naga's reader of GLSL names every member of a block, asked for or not.
                    if info[place].ref_count == 0 {
                        continue;
                    }
                    let name = members.get(*index as usize).and_then(|m| m.name.clone());
                    names.extend(name);
                }
            }
            // It is passed on, or loaded as a whole.
            if mentions
                .iter()
                .any(|(p, parts)| info[*p].ref_count > *parts)
            {
                return Self::All;
            }
        }
        Self::Members(names)
    }

    #[cfg(feature = "search")]
    pub(crate) fn any(&self) -> bool {
        *self != Self::Nothing
    }

    #[cfg(feature = "search")]
    pub(crate) fn uses(&self, path: &str) -> bool {
        match self {
            Self::Nothing => false,
            Self::All => true,
            Self::Members(names) => path
                .split(['.', '['])
                .nth(1)
                .is_none_or(|member| names.contains(member)),
        }
    }
}

fn functions<'s>(
    module: &'s Module,
    info: &'s ModuleInfo,
) -> impl Iterator<Item = (&'s Function, &'s FunctionInfo)> {
    let plain = module.functions.iter().map(|(h, f)| (f, &info[h]));
    let entries = module.entry_points.iter().enumerate();
    plain.chain(entries.map(|(i, e)| (&e.function, info.get_entry_point(i))))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn members_that_are_never_read_need_no_value() {
        let text =
            "struct S { a: f32, gloss: f32, unused: f32 } @group(0) @binding(0) var<uniform> s: S;
            fn f() -> f32 { return s.a; }
            @fragment fn fs() -> @location(0) vec4f { return vec4f(f() + s.gloss + s.gloss); }";
        let source = Source::parse("a.wgsl", text).unwrap();
        let (handle, _) = source.module.global_variables.iter().next().unwrap();
        let Used::Members(names) = Used::of(&source, handle) else {
            panic!()
        };
        assert!(!names.contains("unused") && names.contains("gloss") && names.contains("a"));
        let whole = Source::parse(
            "a.wgsl",
            "struct S { a: f32, b: f32 } @group(0) @binding(0) var<uniform> s: S;
            @fragment fn fs() -> @location(0) vec4f { let t = s; return vec4f(t.a); }",
        )
        .unwrap();
        let (handle, _) = whole.module.global_variables.iter().next().unwrap();
        assert_eq!(Used::of(&whole, handle), Used::All);
    }

    #[test]
    fn members_of_a_glsl_block_without_an_instance_are_read_where_they_are_named() {
        let text = "#version 450
            layout(location = 0) out vec4 colour;
            layout(std140, binding = 0) uniform S { float a; float gloss; float unused; };
            float f() { return a; }
            void main() { colour = vec4(f() + gloss); }";
        let source = Source::parse("a.frag", text).unwrap();
        let mut variables = source.module.global_variables.iter();
        let (handle, _) = variables.find(|(_, v)| v.binding.is_some()).unwrap();
        let names = ["a", "gloss"].map(str::to_owned).into();
        assert_eq!(Used::of(&source, handle), Used::Members(names));
    }
}
