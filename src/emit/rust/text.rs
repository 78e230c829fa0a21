//! Pieces of Rust: an expression with how tightly it binds, and names that Rust allows.

/// How tightly an expression binds, from the loosest.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Level {
    /// `if a { b } else { c }`.
    Block,
    Compare,
    BitOr,
    BitXor,
    BitAnd,
    Shift,
    Sum,
    Product,
    Cast,
    Unary,
    /// Names, literals, calls, and what is behind a dot or in brackets.
    Atom,
}

/// An expression.
#[derive(Clone, Debug)]
pub(super) struct Text {
    pub(super) text: String,
    pub(super) level: Level,
    /// Whether only what is around it says that its floats are of 32 bits.
    pub(super) is_loose: bool,
}

impl Text {
    pub(super) fn new(text: impl Into<String>, level: Level) -> Self {
        Self {
            text: text.into(),
            level,
            is_loose: false,
        }
    }

    pub(super) fn atom(text: impl Into<String>) -> Self {
        Self::new(text, Level::Atom)
    }

    /// A float as a literal.
    pub(super) fn float(x: f32) -> Self {
        let (text, level) = match x {
            // What a literal cannot say is made of its bits.
            x if !x.is_finite() => (format!("f32::from_bits({:#x})", x.to_bits()), Level::Atom),
            x if x.is_sign_negative() => (format!("{x:?}"), Level::Unary),
            x => (format!("{x:?}"), Level::Atom),
        };
        Self {
            is_loose: x.is_finite(),
            ..Self::new(text, level)
        }
    }

    /// An integer of 32 bits as a literal.
    pub(super) fn integer(bits: u32, is_signed: bool) -> Self {
        match (is_signed, bits as i32) {
            (true, x) if x < 0 => Self::new(format!("{x}i32"), Level::Unary),
            (true, x) => Self::atom(format!("{x}i32")),
            (false, _) => Self::atom(format!("{bits}u32")),
        }
    }

    /// The text where at least this level is wanted.
    pub(super) fn within(&self, level: Level) -> String {
        match self.level >= level {
            true => self.text.clone(),
            false => format!("({})", self.text),
        }
    }

    /// An operator between two expressions, each of which may be of the operator's own level on the left.
    pub(super) fn binary(left: &Self, operator: &str, right: &Self, level: Level) -> Self {
        // Behind a cast `<` would open a list of types.
        let left_text = match left.level {
            Level::Cast => left.within(Level::Unary),
            // Comparisons are not chained.
            _ if level == Level::Compare => left.within(Level::BitOr),
            _ => left.within(level),
        };
        let tighter = match level {
            Level::Compare => Level::BitOr,
            Level::BitOr => Level::BitXor,
            Level::BitXor => Level::BitAnd,
            Level::BitAnd => Level::Shift,
            Level::Shift => Level::Sum,
            Level::Sum => Level::Product,
            _ => Level::Cast,
        };
        let right_text = right.within(tighter);
        Self {
            is_loose: left.is_loose && right.is_loose,
            ..Self::new(format!("{left_text} {operator} {right_text}"), level)
        }
    }

    /// The same where nothing around it says what its floats are.
    pub(super) fn pinned(&self) -> Self {
        match self.is_loose {
            true => Self::new(format!("{} as f32", self.within(Level::Unary)), Level::Cast),
            false => self.clone(),
        }
    }

    /// A function's value.
    pub(super) fn call(function: &str, arguments: &[Self]) -> Self {
        Self::atom(format!("{function}({})", listed(arguments)))
    }

    /// An array.
    pub(super) fn array(elements: &[Self]) -> Self {
        Self {
            is_loose: elements.iter().all(|element| element.is_loose),
            ..Self::atom(format!("[{}]", listed(elements)))
        }
    }

    /// An element, at a place that is written already.
    pub(super) fn index(&self, at: impl std::fmt::Display) -> Self {
        Self {
            is_loose: self.is_loose,
            ..Self::atom(format!("{}[{at}]", self.within(Level::Atom)))
        }
    }
}

fn listed(all: &[Text]) -> String {
    let texts: Vec<&str> = all.iter().map(|text| text.text.as_str()).collect();
    texts.join(", ")
}

/// Rust's keywords, in use or kept, of every edition.
const KEYWORDS: [&str; 53] = [
    "abstract", "as", "async", "await", "become", "box", "break", "const", "continue", "crate",
    "do", "dyn", "else", "enum", "extern", "false", "final", "fn", "for", "gen", "if", "impl",
    "in", "let", "loop", "macro", "match", "mod", "move", "mut", "override", "priv", "pub", "ref",
    "return", "self", "Self", "static", "struct", "super", "trait", "true", "try", "type",
    "typeof", "unsafe", "unsized", "use", "virtual", "where", "while", "yield", "_",
];

/// Those that cannot be written raw.
const NEVER_RAW: [&str; 5] = ["crate", "self", "Self", "super", "_"];

/// An identifier of WGSL as one of Rust.
pub(super) fn rust_name(name: &str) -> String {
    if NEVER_RAW.contains(&name) {
        return format!("{name}_");
    }
    match KEYWORDS.contains(&name) {
        true => format!("r#{name}"),
        false => name.to_owned(),
    }
}

/// `InverseSqrt` as `inverse_sqrt`.
pub(super) fn snake_case(name: &str) -> String {
    let mut out = String::new();
    for c in name.chars() {
        if c.is_uppercase() && !out.is_empty() {
            out.push('_');
        }
        out.extend(c.to_lowercase());
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn brackets_stand_where_they_change_the_meaning() {
        let [a, b, c] = ["a", "b", "c"].map(Text::atom);
        let sum = Text::binary(&a, "+", &b, Level::Sum);
        let with = |left: &Text, operator, right: &Text, level| {
            Text::binary(left, operator, right, level).text
        };
        assert_eq!(with(&sum, "*", &c, Level::Product), "(a + b) * c");
        assert_eq!(with(&sum, "-", &c, Level::Sum), "a + b - c");
        assert_eq!(with(&c, "-", &sum, Level::Sum), "c - (a + b)");
        assert_eq!(with(&sum, "<", &c, Level::Compare), "a + b < c");
        let cast = Text::new("a as u32", Level::Cast);
        assert_eq!(with(&cast, "<", &c, Level::Compare), "(a as u32) < c");
        let less = Text::binary(&a, "<", &b, Level::Compare);
        assert_eq!(with(&less, "==", &c, Level::Compare), "(a < b) == c");
        assert_eq!(with(&less, "&", &c, Level::BitAnd), "(a < b) & c");
    }

    #[test]
    fn floats_that_nothing_types_are_typed() {
        let half = Text::float(0.5);
        let twice = Text::binary(&half, "*", &Text::float(-2.0), Level::Product);
        assert_eq!(twice.pinned().text, "(0.5 * -2.0) as f32");
        let known = Text::binary(&Text::atom("x"), "*", &half, Level::Product);
        assert_eq!(known.pinned().text, "x * 0.5");
        assert_eq!(
            Text::float(f32::INFINITY).pinned().text,
            "f32::from_bits(0x7f800000)"
        );
    }

    #[test]
    fn names_are_rusts() {
        assert_eq!(rust_name("type"), "r#type");
        assert_eq!(rust_name("self"), "self_");
        assert_eq!(rust_name("light"), "light");
        assert_eq!(snake_case("InverseSqrt"), "inverse_sqrt");
    }
}
