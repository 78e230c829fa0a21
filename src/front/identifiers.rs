//! Names of WGSL: which ones it keeps for itself, how a unique one is found, how a wish becomes one.

use naga::keywords::wgsl::{BUILTIN_IDENTIFIERS, RESERVED};
use std::collections::BTreeSet;
use std::sync::LazyLock;

/// Keywords, reserved words, and the predeclared types, functions and enumerants.
static TAKEN: LazyLock<BTreeSet<String>> = LazyLock::new(|| {
    let mut taken: BTreeSet<String> = RESERVED
        .iter()
        .chain(BUILTIN_IDENTIFIERS)
        .map(|word| (*word).to_owned())
        .collect();
    for suffix in ["f", "h", "i", "u"] {
        for n in 2..=4 {
            taken.insert(format!("vec{n}{suffix}"));
            for m in 2..=4 {
                taken.insert(format!("mat{n}x{m}{suffix}"));
            }
        }
    }
    taken
});

/// Whether WGSL has a meaning for a word already.
pub(crate) fn is_predeclared(word: &str) -> bool {
    TAKEN.contains(word)
}

/// Names that are in use. Cloned for the scope of a function.
#[derive(Clone, Debug, Default)]
pub(crate) struct Names(BTreeSet<String>);

impl Names {
    /// Takes names out of circulation.
    pub(crate) fn reserve(&mut self, names: impl IntoIterator<Item = impl Into<String>>) {
        self.0.extend(names.into_iter().map(Into::into));
    }

    /// Whether a name is free.
    pub(crate) fn is_free(&self, name: &str) -> bool {
        !self.0.contains(name) && !is_predeclared(name)
    }

    /// As [`Names::take`], for members of a struct: predeclared words are free there, keywords are not.
    pub(crate) fn take_member(&mut self, wish: &str) -> String {
        if BUILTIN_IDENTIFIERS.contains(&wish) && self.0.insert(wish.to_owned()) {
            return wish.to_owned();
        }
        self.take(wish)
    }

    /// Finds a free name for a wish, and takes it: the wish itself, or with `_b`, `_c`, ... behind it. Such
    /// names keep their form when naga writes them again.
    pub(crate) fn take(&mut self, wish: &str) -> String {
        self.first_free(wish, letters, Self::is_free)
    }

    /// As [`Names::take`], for what is local to a function: with `_2`, `_3`, ... behind it. What is predeclared
    /// may be hidden there, but for the words that the function uses.
    pub(crate) fn take_local(&mut self, wish: &str, used: &BTreeSet<String>) -> String {
        let is_free = |names: &Self, name: &str| {
            !names.0.contains(name) && !used.contains(name) && !RESERVED.contains(&name)
        };
        self.first_free(wish, |n| (n + 1).to_string(), is_free)
    }

    fn first_free(
        &mut self,
        wish: &str,
        number: impl Fn(usize) -> String,
        is_free: impl Fn(&Self, &str) -> bool,
    ) -> String {
        let wish = identifier(wish);
        let name = std::iter::once(wish.clone())
            .chain((1..).map(|n| format!("{wish}_{}", number(n))))
            .find(|name| is_free(self, name))
            .unwrap_or(wish);
        self.0.insert(name.clone());
        name
    }
}

/// `a`, `b`, ... `z`, `ba`, ... for 0, 1, ...: numbers in base 26.
pub(crate) fn letters(mut n: usize) -> String {
    let mut out = Vec::new();
    loop {
        out.push(b'a' + (n % 26) as u8);
        n /= 26;
        if n == 0 {
            break;
        }
    }
    out.iter().rev().map(|byte| char::from(*byte)).collect()
}

/// The nearest identifier to a wish: other characters become one `_`.
pub(crate) fn identifier(wish: &str) -> String {
    let mut out = String::new();
    for c in wish.chars() {
        if c == '_' || c.is_alphanumeric() {
            out.push(c);
        } else if !out.ends_with('_') && !out.is_empty() {
            out.push('_');
        }
    }
    while out.ends_with('_') && !wish.ends_with('_') {
        out.pop();
    }
    if out.is_empty() || out == "_" {
        return "value".to_owned();
    }
    if out.starts_with(|c: char| c.is_numeric()) || out.starts_with("__") {
        out.insert(0, 'v');
    }
    out
}

/// A number in words, joined by `_`, for names that may not end in a digit.
pub(crate) fn in_words(n: usize) -> String {
    const ONES: [&str; 20] = [
        "zero",
        "one",
        "two",
        "three",
        "four",
        "five",
        "six",
        "seven",
        "eight",
        "nine",
        "ten",
        "eleven",
        "twelve",
        "thirteen",
        "fourteen",
        "fifteen",
        "sixteen",
        "seventeen",
        "eighteen",
        "nineteen",
    ];
    const TENS: [&str; 8] = [
        "twenty", "thirty", "forty", "fifty", "sixty", "seventy", "eighty", "ninety",
    ];
    match n {
        0..20 => ONES[n].to_owned(),
        20..100 if n.is_multiple_of(10) => TENS[n / 10 - 2].to_owned(),
        20..100 => format!("{}_{}", TENS[n / 10 - 2], ONES[n % 10]),
        _ => letters(n),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn takes_the_wish_or_the_next_free_name() {
        let mut names = Names::default();
        names.reserve(["lod", "lod_b"]);
        assert_eq!(names.take("lod"), "lod_c");
        assert_eq!(names.take("lod"), "lod_d");
        assert_eq!(names.take("mix"), "mix_b");
        assert_eq!(names.take("fn"), "fn_b");
        assert_eq!(names.take("vec3f"), "vec3f_b");
        let used = BTreeSet::from(["mix".to_owned()]);
        assert_eq!(names.take_local("lod", &used), "lod_2");
        assert_eq!(names.take_local("lod", &used), "lod_3");
        assert_eq!(names.take_local("mix", &used), "mix_2");
        assert_eq!(names.take_local("distance", &used), "distance");
        assert_eq!(names.take_local("fn", &used), "fn_2");
    }

    #[test]
    fn wishes_become_identifiers() {
        assert_eq!(identifier("specular.pow"), "specular_pow");
        assert_eq!(identifier("a[2].b"), "a_2_b");
        assert_eq!(identifier("2d"), "v2d");
        assert_eq!(identifier("__x"), "v__x");
        assert_eq!(identifier("tint__x_"), "tint__x_");
        assert_eq!(identifier("größe"), "größe");
        assert_eq!(identifier("..."), "value");
    }

    #[test]
    fn numbers_have_words() {
        assert_eq!(in_words(2), "two");
        assert_eq!(in_words(21), "twenty_one");
        assert_eq!(in_words(90), "ninety");
        assert_eq!(letters(0), "a");
        assert_eq!(letters(26), "ba");
    }
}
