//! The names of a composed module as people wrote them.
//!
//! naga_oil puts the path of its module behind every imported name, in base 32. A name that only one module
//! has gets its own back; of those that several have, the text that was composed keeps its own, and the others
//! get the last part of their module's path before them, or more of it.

use naga::keywords::wgsl::{BUILTIN_IDENTIFIERS, RESERVED};
use naga::{Function, Module};
use std::collections::{BTreeMap, BTreeSet};

/// What naga_oil puts between a name and its module, and behind the module.
const PRE: [&str; 2] = ["X_naga_oil_mod_X", "X_naga_oil_vrt_X"];
const POST: char = 'X';

/// A mangled name: the item, and the path of its module.
pub(super) fn parts(name: &str) -> Option<(String, String)> {
    let (at, pre) = PRE
        .iter()
        .filter_map(|pre| Some((name.find(pre)?, pre)))
        .min()?;
    let (item, rest) = (&name[..at], &name[at + pre.len()..]);
    // An override function has the module that it overrides, then its own.
    let rest = PRE
        .iter()
        .fold(rest, |rest, pre| rest.split(pre).next().unwrap_or(rest));
    let digits = rest
        .find(|c: char| !matches!(c, 'A'..='Z' | '2'..='7'))
        .unwrap_or(rest.len());
    // `X` is a digit too; the last one ends the path.
    let module = base32(&rest[..rest[..digits].rfind(POST)?])?;
    Some((item.to_owned(), module))
}

/// The text that RFC 4648 writes so, without padding.
fn base32(digits: &str) -> Option<String> {
    let mut bytes = Vec::new();
    let (mut word, mut bits) = (0u32, 0);
    for digit in digits.bytes() {
        let value = match digit {
            b'A'..=b'Z' => digit - b'A',
            b'2'..=b'7' => digit - b'2' + 26,
            _ => return None,
        };
        word = (word << 5) | u32::from(value);
        bits += 5;
        if bits >= 8 {
            bits -= 8;
            bytes.push((word >> bits) as u8);
            word &= (1 << bits) - 1;
        }
    }
    String::from_utf8(bytes).ok()
}

/// Replaces mangled names in a message by paths as they are imported: `a::b::item`.
pub(super) fn readable(message: &str) -> String {
    let joins = |c: char| c.is_alphanumeric() || c == '_';
    let mut out = String::new();
    let mut rest = message;
    while let Some(start) = rest.find(joins) {
        let end = rest[start..]
            .find(|c| !joins(c))
            .map_or(rest.len(), |n| start + n);
        out.push_str(&rest[..start]);
        match parts(&rest[start..end]) {
            Some((item, module)) => {
                out.push_str(&module);
                out.push_str("::");
                out.push_str(&item);
            }
            None => out.push_str(&rest[start..end]),
        }
        rest = &rest[end..];
    }
    out + rest
}

/// A module in which everything has the name that it was written with.
pub(in crate::front) fn demangled(mut module: Module) -> Module {
    let names = plain_names(&module);
    let plain = |name: &mut Option<String>| {
        if let Some(name) = name
            && let Some(plain) = names.get(name)
        {
            name.clone_from(plain);
        }
    };
    let types: Vec<_> = module.types.iter().map(|(handle, _)| handle).collect();
    for handle in types {
        let mut ty = module.types[handle].clone();
        plain(&mut ty.name);
        if ty.name != module.types[handle].name {
            module.types.replace(handle, ty);
        }
    }
    for (_, constant) in module.constants.iter_mut() {
        plain(&mut constant.name);
    }
    for (_, setting) in module.overrides.iter_mut() {
        plain(&mut setting.name);
    }
    for (_, variable) in module.global_variables.iter_mut() {
        plain(&mut variable.name);
    }
    for (_, function) in module.functions.iter_mut() {
        plain(&mut function.name);
        local_names(function);
    }
    for entry in &mut module.entry_points {
        local_names(&mut entry.function);
    }
    module
}

/// A local that is called like something imported was mangled too.
fn local_names(function: &mut Function) {
    let plain = |name: &mut String| {
        if let Some((item, _)) = parts(name) {
            *name = item;
        }
    };
    for argument in &mut function.arguments {
        argument.name.as_mut().map(plain);
    }
    for (_, variable) in function.local_variables.iter_mut() {
        variable.name.as_mut().map(plain);
    }
    function.named_expressions.values_mut().for_each(plain);
}

/// A plain name for every mangled one of a module's scope.
fn plain_names(module: &Module) -> BTreeMap<String, String> {
    let types = module.types.iter().filter_map(|(_, t)| t.name.as_ref());
    let constants = module.constants.iter().filter_map(|(_, c)| c.name.as_ref());
    let settings = module.overrides.iter().filter_map(|(_, o)| o.name.as_ref());
    let variables = module.global_variables.iter();
    let variables = variables.filter_map(|(_, v)| v.name.as_ref());
    let functions = module.functions.iter().filter_map(|(_, f)| f.name.as_ref());
    let entries = module.entry_points.iter().map(|e| &e.name);
    let all: BTreeSet<&String> = types
        .chain(constants)
        .chain(settings)
        .chain(variables)
        .chain(functions)
        .chain(entries)
        .collect();
    let mut taken: BTreeSet<String> = BTreeSet::new();
    let mut mangled: BTreeMap<String, Vec<(&String, String)>> = BTreeMap::new();
    for name in all {
        match parts(name) {
            Some((item, path)) => mangled.entry(item).or_default().push((name, path)),
            None => {
                taken.insert(name.clone());
            }
        }
    }
    // What only one module has comes first: nobody else's collision takes it away.
    let (alone, shared): (Vec<_>, Vec<_>) = mangled
        .into_iter()
        .partition(|(item, of)| of.len() == 1 && !taken.contains(item) && is_free(item));
    let mut plain = BTreeMap::new();
    for (item, of) in alone {
        for (name, _) in of {
            taken.insert(item.clone());
            plain.insert(name.clone(), item.clone());
        }
    }
    for (item, of) in shared {
        for (name, path) in of {
            let parts: Vec<&str> = path.split("::").collect();
            let longer: Vec<String> = (0..parts.len())
                .rev()
                .map(|from| {
                    let path = parts[from..].join("_");
                    let plain = |c: char| if c.is_alphanumeric() { c } else { '_' };
                    let path: String = path.chars().map(plain).collect();
                    format!("{}_{item}", path.trim_matches('_'))
                })
                .collect();
            let free = |wish: &&String| !taken.contains(*wish) && is_free(wish);
            let wish = longer.iter().find(free).or(longer.last());
            let mut wish = wish.unwrap_or(&item).clone();
            while taken.contains(&wish) {
                wish.push_str("_other");
            }
            taken.insert(wish.clone());
            plain.insert(name.clone(), wish);
        }
    }
    plain
}

/// Whether a name may stand at module scope without hiding what WGSL calls so.
fn is_free(name: &str) -> bool {
    !RESERVED.contains(&name) && !BUILTIN_IDENTIFIERS.contains(&name)
}

#[cfg(test)]
mod tests {
    use super::*;
    use naga_oil::compose::Composer;

    #[test]
    fn mangled_names_are_taken_apart() {
        for path in [
            "bevy_pbr::pbr_types",
            "a",
            "x::xx::X",
            "WWW::23",
            "a::\u{fc}",
        ] {
            let name = Composer::decorated_name(Some(path), "light");
            let (item, module) = parts(&name).expect(path);
            assert_eq!((item.as_str(), module.as_str()), ("light", path), "{name}");
            assert_eq!(
                readable(&format!("no `{name}` here")),
                format!("no `{path}::light` here")
            );
        }
        assert_eq!(parts("plain"), None);
        assert_eq!(readable("nothing to see"), "nothing to see");
    }

    #[test]
    fn names_that_several_have_get_their_modules() {
        let mangled = |path, item| Composer::decorated_name(Some(path), item);
        let (a, b, c, d) = (
            mangled("one::fog", "shade"),
            mangled("two::fog", "shade"),
            mangled("one::fog", "only"),
            mangled("two::fog", "mix"),
        );
        let text = format!(
            "fn {a}(x: f32) -> f32 {{ return x; }} fn {b}(x: f32) -> f32 {{ return x; }}
             fn {c}(x: f32) -> f32 {{ return x; }} fn {d}(x: f32) -> f32 {{ let {c} = x; return {c}; }}
             fn shade(x: f32) -> f32 {{ return {a}({b}({c}({d}(x)))); }}"
        );
        let module = demangled(naga::front::wgsl::parse_str(&text).unwrap());
        let names: Vec<_> = module
            .functions
            .iter()
            .map(|(_, f)| f.name.clone().unwrap())
            .collect();
        assert_eq!(
            names,
            ["fog_shade", "two_fog_shade", "only", "fog_mix", "shade"]
        );
        let (_, mixed) = module.functions.iter().nth(3).unwrap();
        assert_eq!(
            mixed.named_expressions.values().collect::<Vec<_>>(),
            ["only"]
        );
    }
}
