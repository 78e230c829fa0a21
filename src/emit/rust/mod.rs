//! The parameter stage as plain Rust, for hosts that fill the block on the CPU: `rock.lod.rs` beside `rock.lod.wgsl`.
//!
//! It is written from the module that the emitted text is read back as, so that it says what the compute entry point says:
//! a structure for each uniform that the stage reads and for the block, with the layout of the buffers, and a function from
//! references to the ones to the other. It needs `libm` and nothing else, no allocation and no `unsafe`, and it can be
//! included or be a module of its own.

mod function;
mod prelude;
mod text;
mod types;

use super::lock::FORMAT;
use super::{file_name, flaw};
use crate::front::Source;
use crate::front::identifiers::{Names, identifier};
use crate::{Diagnostic, Result};
use function::{Body, Shared};
use lodc_passes::operands;
use naga::{
    AddressSpace, EntryPoint, Expression, Function, GlobalVariable, Handle, Module, ScalarKind,
    Statement, StorageAccess, TypeInner,
};
use prelude::{MODULE, Prelude};
use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write;
use text::rust_name;
use types::{Numbers, Types};

/// What is written, or what there is no form for.
type Written<T> = std::result::Result<T, String>;

/// A variable of the module that functions are handed.
struct Global {
    name: String,
    /// The name of the array at its end whose length only the buffer tells.
    slice: Option<String>,
    /// Whether there is anything before that.
    has_value: bool,
    /// Whether functions store to it.
    is_stored: bool,
}

/// The parameter stage of an emitted text, its compute entry point of this name. The name of the file begins with `stem`.
///
/// # Errors
/// When the stage has something in it that there is no form for: a flaw, since what can be moved there can be written.
pub(super) fn written(
    source: &Source,
    emitted: &Module,
    entry: &str,
    stem: &str,
) -> Result<String> {
    let point = emitted
        .entry_points
        .iter()
        .find(|point| point.name == entry);
    let Some(point) = point else {
        let error = Diagnostic::error(format!("internal error: there is no entry point `{entry}`"));
        return Err(flaw(error, source));
    };
    let header = format!(
        "// What is computed once a draw for the levels of {}, by lodc (lock format {FORMAT}). Made from the lock: change that,\n\
         // not this. It does on the CPU what the entry point `{entry}` of {stem} does on the GPU.\n",
        file_name(source)
    );
    match stage(emitted, point) {
        Ok(text) => Ok(format!("{header}{text}")),
        Err(reason) => {
            let error = Diagnostic::error(format!(
                "internal error: the parameters of {} cannot be written as Rust: {reason}",
                file_name(source)
            ));
            Err(flaw(error, source))
        }
    }
}

/// The text of an entry point that fills a storage buffer.
fn stage(module: &Module, point: &EntryPoint) -> Written<String> {
    staged(Types::new(module)?, point)
}

/// The same, with structures that have been asked for already.
fn staged<'a>(types: Types<'a>, point: &'a EntryPoint) -> Written<String> {
    let module = types.module;
    let called = called_by(module, &point.function);
    let mut read = variables_of(&point.function);
    for function in &called {
        read.extend(variables_of(&module.functions[*function]));
    }
    let stored = stored(module, &read)?;
    let ty = module.global_variables[stored].ty;
    let mut names = Names::default();
    names.reserve([MODULE, "libm"]);
    let mut shared = Shared {
        globals: globals(module, &types, &read, stored, &mut names)?,
        types,
        prelude: Prelude::default(),
        constants: BTreeMap::new(),
        needs: needs(module),
        functions: module
            .functions
            .iter()
            .map(|(_, f)| name_of(f.name.as_deref()))
            .collect(),
    };

    let block = shared.types.value(ty)?;
    let parameters = handed(&mut shared, &read, Some(stored))?;
    let own = shared.globals[&stored].name.clone();
    let body = Body::new(&mut shared, &point.function, Some(stored))?;
    let body = body.written(Some(own.clone()))?;
    let mut functions = format!(
        "\n/// The parameters of a draw with these uniforms.\n{ALLOWED}\
         pub fn {}({}) -> {block} {{\n    let mut {own} = {block}::default();\n{body}}}\n",
        name_of(Some(&point.name)),
        parameters.join(", "),
    );
    for handle in &called {
        functions.push_str(&function(&mut shared, &module.functions[*handle], *handle)?);
    }
    let bytes = bytes(&mut shared, &block, ty)?;

    let mut out = String::new();
    let declared = shared.types.declared()?;
    for (of, text) in &declared {
        write!(out, "\n{text}").ok();
        if *of == ty {
            out.push_str(&bytes);
        }
    }
    for constant in shared.constants.values() {
        out.push_str(constant);
    }
    out.push_str(&functions);
    out.push_str(&shared.prelude.written());
    Ok(out)
}

/// The buffers of an emitted text as Rust.
pub(crate) struct Buffers {
    /// Structures with their layouts, and the parameter stage where there is one.
    pub(crate) text: String,
    /// The type of each uniform and storage buffer that can be written as one.
    pub(crate) types: BTreeMap<Handle<GlobalVariable>, String>,
    /// The names of the structures that these are made of.
    pub(crate) structures: Vec<String>,
}

/// The structures of all buffers that an emitted text declares, and its parameter stage, which is the entry point of this
/// name. A buffer that Rust has no type for, such as one of atomics, is left out.
///
/// # Errors
/// When the stage has something in it that there is no form for: a flaw, since what can be moved there can be written.
pub(crate) fn buffers(source: &Source, emitted: &Module, entry: Option<&str>) -> Result<Buffers> {
    let points = emitted.entry_points.iter();
    let point = points.clone().find(|point| Some(&*point.name) == entry);
    all_buffers(emitted, point).map_err(|reason| {
        let error = Diagnostic::error(format!(
            "internal error: the buffers of {} cannot be written as Rust: {reason}",
            file_name(source)
        ));
        flaw(error, source)
    })
}

fn all_buffers(module: &Module, point: Option<&EntryPoint>) -> Written<Buffers> {
    let mut types = Types::new(module)?;
    let mut of_buffers = BTreeMap::new();
    for (handle, variable) in module.global_variables.iter() {
        let is_buffer = matches!(
            variable.space,
            AddressSpace::Uniform | AddressSpace::Storage { .. }
        );
        if is_buffer && let Ok(ty) = buffer(&mut types, variable.ty) {
            of_buffers.insert(handle, ty);
        }
    }
    let structures = types.declared_names();
    let mut text = String::new();
    match point {
        Some(point) => text = staged(types, point)?,
        None => {
            for (_, declared) in types.declared()? {
                write!(text, "\n{declared}").ok();
            }
        }
    }
    Ok(Buffers {
        text,
        types: of_buffers,
        structures,
    })
}

/// The type of a buffer: of one that ends in an array whose length only it tells, what is before that, or its element.
fn buffer(types: &mut Types<'_>, ty: Handle<naga::Type>) -> Written<String> {
    let element = last_element(types, ty);
    let of_element = element.map(|element| types.element(element)).transpose()?;
    match of_element {
        Some(of_element) if types.runtime_element(ty).is_some() => Ok(format!("[{of_element}]")),
        _ => types.stored(ty),
    }
}

/// What the functions may look like that nobody wrote by hand.
const ALLOWED: &str = "#[allow(clippy::all, clippy::pedantic, non_snake_case, unreachable_code, unused_assignments, unused_labels, unused_mut, unreachable_pub)]\n";

/// A function that the entry point calls.
fn function(
    shared: &mut Shared<'_>,
    function: &Function,
    handle: Handle<Function>,
) -> Written<String> {
    let name = shared.functions[handle.index()].clone();
    let needs = shared.needs[handle.index()].clone();
    let returned = match &function.result {
        Some(result) => format!(" -> {}", shared.types.value(result.ty)?),
        None => String::new(),
    };
    let mut parameters = Vec::new();
    let handed = handed(shared, &needs, None)?;
    let module = shared.types.module;
    let mut body = Body::new(shared, &module.functions[handle], None)?;
    parameters.extend(body.parameters()?);
    parameters.extend(handed);
    let body = body.written(None)?;
    Ok(format!(
        "\n{ALLOWED}fn {name}({}){returned} {{\n{body}}}\n",
        parameters.join(", ")
    ))
}

/// The block as bytes.
fn bytes(shared: &mut Shared<'_>, block: &str, ty: Handle<naga::Type>) -> Written<String> {
    let (members, size) = shared.types.numbers(ty)?;
    let mut lines = String::new();
    for Numbers {
        name,
        offset,
        count,
        kind,
    } in members
    {
        shared.prelude.known("put")?;
        let whole = match count {
            1 => format!("[self.{name}]"),
            _ => format!("self.{name}"),
        };
        let words = match kind {
            ScalarKind::Float => format!("{whole}.map(f32::to_bits)"),
            ScalarKind::Sint => format!("{whole}.map(|x| x as u32)"),
            _ => whole,
        };
        writeln!(
            lines,
            "        {MODULE}::put(&mut bytes, {offset}, {words});"
        )
        .ok();
    }
    Ok(format!(
        "\nimpl {block} {{\n    /// What the buffer holds, in the order of bytes that GPUs have.\n    \
         #[allow(clippy::all, clippy::pedantic, dead_code, unreachable_pub)]\n    pub fn to_bytes(self) -> [u8; {size}] {{\n        \
         let mut bytes = [0; {size}];\n{lines}        bytes\n    }}\n}}\n"
    ))
}

/// How functions take variables.
fn handed(
    shared: &mut Shared<'_>,
    variables: &BTreeSet<Handle<GlobalVariable>>,
    own: Option<Handle<GlobalVariable>>,
) -> Written<Vec<String>> {
    let mut all = Vec::new();
    for variable in variables {
        let Some(Global {
            name,
            slice,
            has_value,
            is_stored,
        }) = shared.globals.get(variable)
        else {
            continue;
        };
        if own == Some(*variable) {
            continue;
        }
        let (name, slice, has_value) = (name.clone(), slice.clone(), *has_value);
        let reference = if *is_stored { "&mut " } else { "&" };
        let ty = shared.types.module.global_variables[*variable].ty;
        if has_value {
            all.push(format!("{name}: {reference}{}", shared.types.stored(ty)?));
        }
        if let Some(slice) = slice {
            let element = last_element(&shared.types, ty).ok_or("an array without elements")?;
            all.push(format!("{slice}: &[{}]", shared.types.element(element)?));
        }
    }
    Ok(all)
}

/// The element of the array at the end of a type whose length only the buffer tells.
fn last_element(types: &Types<'_>, ty: Handle<naga::Type>) -> Option<Handle<naga::Type>> {
    match types.inner(ty) {
        TypeInner::Struct { members, .. } => types.runtime_element(members.last()?.ty),
        _ => types.runtime_element(ty),
    }
}

fn globals(
    module: &Module,
    types: &Types<'_>,
    read: &BTreeSet<Handle<GlobalVariable>>,
    stored: Handle<GlobalVariable>,
    names: &mut Names,
) -> Written<BTreeMap<Handle<GlobalVariable>, Global>> {
    let mut found = BTreeMap::new();
    for handle in read {
        let variable = &module.global_variables[*handle];
        let is_read = match variable.space {
            AddressSpace::Uniform => true,
            AddressSpace::Storage { access } => !access.contains(StorageAccess::STORE),
            _ => false,
        };
        if !is_read && *handle != stored {
            return Err("a variable that is no buffer to read".into());
        }
        let wish = variable.name.as_deref().unwrap_or("uniform");
        let name = rust_name(&names.take_local(wish, &BTreeSet::new()));
        let is_whole = types.runtime_element(variable.ty).is_some();
        let slice = match (types.inner(variable.ty), last_element(types, variable.ty)) {
            (_, None) => None,
            (TypeInner::Struct { members, .. }, Some(_)) => {
                let member = members.last().and_then(|member| member.name.as_deref());
                let wish = format!("{wish}_{}", member.unwrap_or("list"));
                Some(rust_name(&names.take_local(&wish, &BTreeSet::new())))
            }
            (_, Some(_)) => Some(name.clone()),
        };
        let global = Global {
            name,
            slice,
            has_value: !is_whole,
            is_stored: *handle == stored,
        };
        found.insert(*handle, global);
    }
    Ok(found)
}

/// The buffer that is stored to.
fn stored(
    module: &Module,
    read: &BTreeSet<Handle<GlobalVariable>>,
) -> Written<Handle<GlobalVariable>> {
    let mut all = read.iter().filter(|handle| {
        matches!(module.global_variables[**handle].space,
            AddressSpace::Storage { access } if access.contains(StorageAccess::STORE))
    });
    match (all.next(), all.next()) {
        (Some(stored), None) => Ok(*stored),
        _ => Err("another buffer than one that is stored to".into()),
    }
}

/// The functions that a function calls, in the order in which they are called first, with those that they call.
fn called_by(module: &Module, function: &Function) -> Vec<Handle<Function>> {
    let mut found: Vec<Handle<Function>> = Vec::new();
    let mut calls = Vec::new();
    operands::walk(&function.body, &mut |statement| {
        if let Statement::Call { function, .. } = statement {
            calls.push(*function);
        }
    });
    for call in calls {
        let inner = called_by(module, &module.functions[call]);
        for one in [call].into_iter().chain(inner) {
            if !found.contains(&one) {
                found.push(one);
            }
        }
    }
    found
}

/// The variables of the module that a function names.
fn variables_of(function: &Function) -> BTreeSet<Handle<GlobalVariable>> {
    let values = function.expressions.iter();
    values
        .filter_map(|(_, expression)| match expression {
            Expression::GlobalVariable(variable) => Some(*variable),
            _ => None,
        })
        .collect()
}

/// For each function of a module, the variables that it or one that it calls names.
fn needs(module: &Module) -> Vec<BTreeSet<Handle<GlobalVariable>>> {
    let mut all: Vec<BTreeSet<Handle<GlobalVariable>>> = Vec::new();
    // Functions call only those before them.
    for (_, function) in module.functions.iter() {
        let mut own = variables_of(function);
        operands::walk(&function.body, &mut |statement| {
            if let Statement::Call { function, .. } = statement
                && let Some(of) = all.get(function.index())
            {
                own.extend(of);
            }
        });
        all.push(own);
    }
    all
}

fn name_of(name: Option<&str>) -> String {
    rust_name(&identifier(name.unwrap_or("unnamed")))
}
