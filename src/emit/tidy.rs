//! Makes a function that naga's WGSL writer wrote read like one that a person wrote.
//!
//! The writer puts parentheses around every operator, a suffix behind every number, and every load and
//! texture sample on a line of its own. This takes off what the grammar does not need, and puts the values
//! that it is told to back where they are used. It knows the writer's form and no other: one statement a
//! line, blanks around binary operators and nowhere else. What it cannot read it leaves as it is.

use super::tokens::{Kind, tokens};
use std::collections::{BTreeMap, BTreeSet};

/// What may be changed in a function.
#[derive(Clone, Debug, Default)]
pub(crate) struct Style {
    /// Names of `let` declarations whose values are put where they are used.
    pub(crate) inline: BTreeSet<String>,
    /// Whether `vec3<f32>` is written `vec3f`.
    pub(crate) short_types: bool,
    /// Whether numbers need no suffix to keep their type. Not so where an operator has numbers alone:
    /// without suffixes they would be worked out with more digits.
    pub(crate) bare_numbers: bool,
}

/// How tightly an expression holds together, from the tightest.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Level {
    Primary,
    Unary,
    Product,
    Sum,
    /// Shifts and bitwise operators, which mix with nothing.
    Bits(char),
    /// `==` and `!=`.
    Equality,
    /// `<`, `>` and the like: in an argument list they could be read as template brackets.
    Order,
    /// `&&` or `||`.
    Logic(char),
}

#[derive(Clone, Debug)]
struct Written {
    text: String,
    level: Level,
}

impl Written {
    fn primary(text: String) -> Self {
        Self {
            text,
            level: Level::Primary,
        }
    }

    fn parenthesised(self) -> String {
        format!("({})", self.text)
    }

    fn parenthesised_unless(self, fits: bool) -> String {
        if fits {
            self.text
        } else {
            self.parenthesised()
        }
    }
}

/// The function with less clutter, or `None` when it is not in the writer's form.
pub(crate) fn tidy(function: &str, style: &Style) -> Option<String> {
    let mut values = BTreeMap::new();
    let mut lines: Vec<String> = Vec::new();
    for line in function.lines() {
        let content = line.trim_start();
        let indent = &line[..line.len() - content.len()];
        if let Some(content) = statement(content, style, &mut values)? {
            lines.push(format!("{indent}{content}"));
        }
    }
    let lines = without_empty_branches(lines);
    let mut text = lines.join("\n");
    text.push('\n');
    if style.short_types {
        text = with_short_types(&text);
    }
    Some(text)
}

/// One line without its indentation, or `Some(None)` when the line goes away.
fn statement(
    line: &str,
    style: &Style,
    values: &mut BTreeMap<String, Written>,
) -> Option<Option<String>> {
    if line.starts_with("fn ")
        || line.starts_with("case ")
        || line.starts_with("default")
        || line.is_empty()
        || matches!(line, "}" | "{" | "} else {" | "loop {" | "continuing {")
    {
        return Some(Some(line.to_owned()));
    }
    let whole = |text: &str, values: &BTreeMap<String, Written>| -> Option<Written> {
        let mut reader = Reader {
            text,
            at: 0,
            style,
            values,
        };
        let written = reader.expression()?;
        (reader.at == text.len()).then_some(written)
    };
    if let Some(rest) = line.strip_prefix("if ") {
        let condition = whole(rest.strip_suffix(" {")?, values)?;
        return Some(Some(format!("if {} {{", condition.text)));
    }
    if let Some(rest) = line.strip_prefix("switch ") {
        let selector = whole(rest.strip_suffix(" {")?, values)?;
        return Some(Some(format!("switch {} {{", selector.text)));
    }
    let body = line.strip_suffix(';')?;
    if matches!(body, "return" | "break" | "continue" | "discard") {
        return Some(Some(line.to_owned()));
    }
    for keyword in ["return ", "break if "] {
        if let Some(rest) = body.strip_prefix(keyword) {
            return Some(Some(format!("{keyword}{};", whole(rest, values)?.text)));
        }
    }
    if let Some(rest) = body.strip_prefix("let ") {
        let (name, value) = rest.split_once(" = ")?;
        let value = whole(value, values)?;
        if style.inline.contains(name) {
            values.insert(name.to_owned(), value);
            return Some(None);
        }
        return Some(Some(format!("let {name} = {};", value.text)));
    }
    if body.starts_with("var ") {
        return match body.split_once(" = ") {
            None => Some(Some(line.to_owned())),
            Some((start, value)) => {
                Some(Some(format!("{start} = {};", whole(value, values)?.text)))
            }
        };
    }
    if let Some(at) = assignment(body) {
        let place = whole(&body[..at], values)?;
        let value = whole(&body[at + 3..], values)?;
        return Some(Some(format!("{} = {};", place.text, value.text)));
    }
    Some(Some(format!("{};", whole(body, values)?.text)))
}

/// Where the ` = ` of an assignment is.
fn assignment(statement: &str) -> Option<usize> {
    let mut depth = 0usize;
    for (at, byte) in statement.bytes().enumerate() {
        match byte {
            b'(' | b'[' => depth += 1,
            b')' | b']' => depth = depth.saturating_sub(1),
            b' ' if depth == 0 && statement[at..].starts_with(" = ") => return Some(at),
            _ => {}
        }
    }
    None
}

/// `if c { } else { x }` becomes `if !c { x }`.
fn without_empty_branches(lines: Vec<String>) -> Vec<String> {
    let mut out: Vec<String> = Vec::with_capacity(lines.len());
    for line in lines {
        let opened = out
            .last()
            .filter(|_| line.trim_start() == "} else {")
            .and_then(|last| {
                let content = last.trim_start();
                let condition = content.strip_prefix("if ")?.strip_suffix(" {")?;
                let indent = &last[..last.len() - content.len()];
                Some(format!("{indent}if {} {{", negated(condition)))
            });
        match opened {
            Some(opened) => {
                out.pop();
                out.push(opened);
            }
            None => out.push(line),
        }
    }
    out
}

/// The opposite of a condition. Comparisons are not turned round: with a NaN, `!(a < b)` is not `a >= b`.
fn negated(condition: &str) -> String {
    let is_name = condition
        .chars()
        .all(|c| c.is_alphanumeric() || matches!(c, '_' | '.'));
    if is_name {
        return format!("!{condition}");
    }
    if let Some(inner) = condition.strip_prefix('!') {
        if inner
            .chars()
            .all(|c| c.is_alphanumeric() || matches!(c, '_' | '.'))
        {
            return inner.to_owned();
        }
        if let Some(inner) = inner.strip_prefix('(').and_then(|i| i.strip_suffix(')')) {
            let mut depth = 0i32;
            let closes_early = inner.chars().any(|c| {
                depth += match c {
                    '(' => 1,
                    ')' => -1,
                    _ => 0,
                };
                depth < 0
            });
            if !closes_early {
                return inner.to_owned();
            }
        }
    }
    format!("!({condition})")
}

/// Reads expressions of the writer's form.
struct Reader<'a> {
    text: &'a str,
    at: usize,
    style: &'a Style,
    values: &'a BTreeMap<String, Written>,
}

impl<'a> Reader<'a> {
    fn rest(&self) -> &'a str {
        &self.text[self.at..]
    }

    fn eat(&mut self, expected: &str) -> bool {
        let found = self.rest().starts_with(expected);
        if found {
            self.at += expected.len();
        }
        found
    }

    /// An operand, or two with an operator between them.
    fn expression(&mut self) -> Option<Written> {
        let left = self.operand()?;
        let rest = self.rest();
        if !rest.starts_with(' ') {
            return Some(left);
        }
        let operator = rest[1..].split(' ').next()?;
        if !matches!(
            operator,
            "+" | "-"
                | "*"
                | "/"
                | "%"
                | "=="
                | "!="
                | "<"
                | "<="
                | ">"
                | ">="
                | "&"
                | "^"
                | "|"
                | "&&"
                | "||"
                | "<<"
                | ">>"
        ) {
            return None;
        }
        self.at += operator.len() + 2;
        let right = self.operand()?;
        Some(join(left, operator, right))
    }

    fn operand(&mut self) -> Option<Written> {
        let first = self.rest().chars().next()?;
        if first == '(' {
            self.at += 1;
            let inner = self.expression()?;
            if !self.eat(")") {
                return None;
            }
            return self.postfix(inner);
        }
        if matches!(first, '-' | '!' | '~' | '&' | '*') {
            self.at += 1;
            let inner = self.operand()?;
            let fits = inner.level == Level::Primary && !inner.text.starts_with('-');
            return Some(Written {
                text: format!("{first}{}", inner.parenthesised_unless(fits)),
                level: Level::Unary,
            });
        }
        let token = tokens(self.rest()).into_iter().next()?;
        let word = &self.rest()[token.span.clone()];
        match token.kind {
            Kind::Number => {
                self.at += token.span.len();
                let number = if self.style.bare_numbers {
                    bare_number(word)
                } else {
                    plain_number(word)
                };
                Some(Written::primary(number))
            }
            Kind::Word => {
                self.at += token.span.len();
                let value = match self.values.get(word) {
                    Some(value) => value.clone(),
                    None => self.named(word)?,
                };
                self.postfix(value)
            }
            _ => None,
        }
    }

    /// What a word starts: a name, a type, or a call.
    fn named(&mut self, word: &str) -> Option<Written> {
        let mut text = word.to_owned();
        if self.rest().starts_with('<') {
            let mut depth = 0usize;
            let end = self.rest().char_indices().find_map(|(at, c)| {
                match c {
                    '<' => depth += 1,
                    '>' => depth -= 1,
                    _ => {}
                }
                (depth == 0).then_some(at + 1)
            })?;
            text.push_str(&self.rest()[..end]);
            self.at += end;
        }
        if self.eat("(") {
            text.push('(');
            let mut first = true;
            while !self.eat(")") {
                if !first {
                    if !self.eat(", ") {
                        return None;
                    }
                    text.push_str(", ");
                }
                first = false;
                text.push_str(&self.argument()?);
            }
            text.push(')');
        }
        Some(Written::primary(text))
    }

    /// An expression between brackets and commas.
    fn argument(&mut self) -> Option<String> {
        let written = self.expression()?;
        let fits = !matches!(
            written.level,
            Level::Order | Level::Bits('<') | Level::Bits('>')
        );
        Some(written.parenthesised_unless(fits))
    }

    /// Members and elements behind an expression.
    fn postfix(&mut self, base: Written) -> Option<Written> {
        let mut written = base;
        loop {
            if self.rest().starts_with('.') {
                let word = tokens(&self.rest()[1..]).into_iter().next()?;
                let fits = written.level == Level::Primary;
                let member = &self.rest()[1..][word.span.clone()];
                written =
                    Written::primary(format!("{}.{member}", written.parenthesised_unless(fits)));
                self.at += 1 + word.span.len();
            } else if self.eat("[") {
                let index = self.argument()?;
                if !self.eat("]") {
                    return None;
                }
                let fits = written.level == Level::Primary;
                written =
                    Written::primary(format!("{}[{index}]", written.parenthesised_unless(fits)));
            } else {
                return Some(written);
            }
        }
    }
}

/// Joins two operands, with the parentheses that the grammar needs (WGSL, section 8.19).
fn join(left: Written, operator: &str, right: Written) -> Written {
    use Level::*;
    let level = match operator {
        "*" | "/" | "%" => Product,
        "+" | "-" => Sum,
        "==" | "!=" => Equality,
        "<" | "<=" | ">" | ">=" => Order,
        "&&" => Logic('&'),
        "||" => Logic('|'),
        "<<" => Bits('<'),
        ">>" => Bits('>'),
        other => Bits(other.chars().next().unwrap_or('&')),
    };
    let alone = |operand: Level| matches!(operand, Primary | Unary);
    // Operators of one kind group to the left, so only the left operand may be of the same kind.
    let fits = |operand: Level, is_left: bool| match level {
        Product => alone(operand) || (is_left && operand == Product),
        Sum => alone(operand) || operand == Product || (is_left && operand == Sum),
        Equality | Order => alone(operand) || matches!(operand, Product | Sum),
        Bits('<' | '>') => alone(operand),
        _ => alone(operand) || (is_left && operand == level),
    };
    let (left_fits, right_fits) = (fits(left.level, true), fits(right.level, false));
    Written {
        text: format!(
            "{} {operator} {}",
            left.parenthesised_unless(left_fits),
            right.parenthesised_unless(right_fits)
        ),
        level,
    }
}

/// A number with its digits put shortly, suffix and all: `0.0000000001f` becomes `1e-10f`.
fn plain_number(word: &str) -> String {
    match word
        .strip_suffix('f')
        .map(|digits| (digits, digits.parse::<f32>()))
    {
        Some((digits, Ok(value))) if !digits.starts_with("0x") => format!("{value:?}f"),
        _ => word.to_owned(),
    }
}

/// A number without the suffix that its type can do without.
fn bare_number(word: &str) -> String {
    if let Some(digits) = word.strip_suffix('f')
        && !digits.starts_with("0x")
        && let Ok(value) = digits.parse::<f32>()
    {
        let text = format!("{value:?}");
        // Without a suffix it is read as an f64 first: both roundings must lead to the same f32.
        let same = text
            .parse::<f64>()
            .is_ok_and(|wide| (wide as f32).to_bits() == value.to_bits());
        return if same { text } else { format!("{text}f") };
    }
    match word.strip_suffix('i') {
        Some(digits) if digits.bytes().all(|b| b.is_ascii_digit()) => digits.to_owned(),
        _ => word.to_owned(),
    }
}

/// `vec3<f32>` as `vec3f`, and so on for vectors and matrices.
pub(crate) fn with_short_types(text: &str) -> String {
    let all = tokens(text);
    let word = |at: usize| all.get(at).map_or("", |token| &text[token.span.clone()]);
    let mut out = String::with_capacity(text.len());
    let mut at = 0;
    while at < all.len() {
        let suffix = match word(at + 2) {
            "f32" => Some('f'),
            "f16" => Some('h'),
            "i32" => Some('i'),
            "u32" => Some('u'),
            _ => None,
        };
        out.push_str(word(at));
        match suffix {
            Some(suffix) if is_generic(word(at)) && word(at + 1) == "<" && word(at + 3) == ">" => {
                out.push(suffix);
                at += 4;
            }
            _ => at += 1,
        }
    }
    out
}

/// Whether a word is a predeclared vector or matrix type without its component type.
pub(crate) fn is_generic(word: &str) -> bool {
    let digits: &[u8] = match (word.strip_prefix("vec"), word.strip_prefix("mat")) {
        (Some(size), _) => size.as_bytes(),
        (_, Some(size)) => size.as_bytes(),
        _ => return false,
    };
    matches!(digits, [b'2'..=b'4'] if word.starts_with("vec"))
        || matches!(digits, [b'2'..=b'4', b'x', b'2'..=b'4'] if word.starts_with("mat"))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn style() -> Style {
        Style {
            inline: ["u", "s"].map(str::to_owned).into(),
            short_types: true,
            bare_numbers: true,
        }
    }

    #[track_caller]
    fn becomes(written: &str, wanted: &str) {
        let function = format!("fn f() {{\n    {written}\n}}\n");
        let after = tidy(&function, &style()).expect("it is in the writer's form");
        assert_eq!(after, format!("fn f() {{\n    {wanted}\n}}\n"));
    }

    #[test]
    fn takes_off_needless_parentheses() {
        becomes("let x = ((a * b) + c);", "let x = a * b + c;");
        becomes("let x = (a + (b * c));", "let x = a + b * c;");
        becomes("let x = ((a + b) + c);", "let x = a + b + c;");
        becomes("return -((a.x));", "return -a.x;");
        becomes("if (a < b) {", "if a < b {");
        becomes(
            "x[(i + 1i)] = f((a * b), -(c));",
            "x[i + 1] = f(a * b, -c);",
        );
        becomes("let x = ((a == b) && !(c));", "let x = (a == b) && !c;");
        becomes("let x = ((a + b)).xyz;", "let x = (a + b).xyz;");
    }

    #[test]
    fn keeps_parentheses_that_matter() {
        becomes("let x = (a + (b + c));", "let x = a + (b + c);");
        becomes("let x = (a - (b - c));", "let x = a - (b - c);");
        becomes("let x = ((a + b) * c);", "let x = (a + b) * c;");
        becomes("let x = (a / (b * c));", "let x = a / (b * c);");
        becomes("let x = -(-1f);", "let x = -(-1.0);");
        becomes("let x = (a - -(b));", "let x = a - -b;");
        becomes("let x = -((a * b));", "let x = -(a * b);");
        becomes(
            "let x = f((a < b), (c > d));",
            "let x = f((a < b), (c > d));",
        );
        becomes("let x = ((a & b) | c);", "let x = (a & b) | c;");
        becomes("let x = ((a << b) + 1u);", "let x = (a << b) + 1u;");
        becomes("(*p).x = (a + b).x;", "(*p).x = (a + b).x;");
    }

    #[test]
    fn numbers_lose_suffixes_and_zeros_only() {
        becomes("let x = (a * 32f);", "let x = a * 32.0;");
        becomes("let x = (a * 0.0000000001f);", "let x = a * 1e-10;");
        becomes("let x = (a * 0.1f);", "let x = a * 0.1;");
        becomes("let x = (a + 3u);", "let x = a + 3u;");
        becomes("let x = i32(-2147483648);", "let x = i32(-2147483648);");
        assert_eq!(plain_number("32f"), "32.0f");
        assert_eq!(plain_number("2i"), "2i");
    }

    #[test]
    fn types_are_short_where_there_is_a_short_form() {
        becomes(
            "let x = array<vec3<f32>, 2>(vec3<f32>(1f, 2f, 3f), mat3x3<f32>(a, b, c)[0]);",
            "let x = array<vec3f, 2>(vec3f(1.0, 2.0, 3.0), mat3x3f(a, b, c)[0]);",
        );
        becomes("let x = vec2<bool>(a, b);", "let x = vec2<bool>(a, b);");
    }

    #[test]
    fn values_go_where_they_are_used() {
        becomes(
            "let u = m.rough;\n    let s = textureSample(t, p, (a * u));\n    let x = (s.xyz * u);",
            "let x = textureSample(t, p, a * m.rough).xyz * m.rough;",
        );
    }

    #[test]
    fn an_empty_branch_turns_the_condition_round() {
        becomes(
            "if (i < 4i) {\n    } else {\n        break;\n    }",
            "if !(i < 4) {\n        break;\n    }",
        );
        becomes("if c {\n    } else {\n    }", "if !c {\n    }");
        becomes(
            "if !((a && b)) {\n    } else {\n    }",
            "if a && b {\n    }",
        );
        assert_eq!(negated("!(a) || (b)"), "!(!(a) || (b))");
    }

    #[test]
    fn what_it_cannot_read_it_declines() {
        assert_eq!(tidy("fn f() {\n    x += 1;\n}\n", &style()), None);
    }
}
