//! Makes a function that naga's WGSL writer wrote read like one that a person wrote.
//!
//! The writer puts parentheses around every operator, a suffix behind every number, and every load and
//! texture sample on a line of its own. This takes off what the grammar does not need, and puts the values
//! that it is told to back where they are used. It knows the writer's form and no other: one statement a
//! line, blanks around binary operators and nowhere else. What it cannot read it leaves as it is.

mod blocks;
mod expression;

use super::tokens::tokens;
use expression::{Written, read};
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
    let mut text = blocks::simplified(lines).join("\n");
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
    if let Some(rest) = line.strip_prefix("if ") {
        let condition = read(rest.strip_suffix(" {")?, style, values)?;
        return Some(Some(format!("if {} {{", condition.text)));
    }
    if let Some(rest) = line.strip_prefix("switch ") {
        let selector = read(rest.strip_suffix(" {")?, style, values)?;
        return Some(Some(format!("switch {} {{", selector.text)));
    }
    let body = line.strip_suffix(';')?;
    if matches!(body, "return" | "break" | "continue" | "discard") {
        return Some(Some(line.to_owned()));
    }
    for keyword in ["return ", "break if "] {
        if let Some(rest) = body.strip_prefix(keyword) {
            return Some(Some(format!(
                "{keyword}{};",
                read(rest, style, values)?.text
            )));
        }
    }
    if let Some(rest) = body.strip_prefix("let ") {
        let (name, value) = rest.split_once(" = ")?;
        let value = read(value, style, values)?;
        if style.inline.contains(name) {
            values.insert(name.to_owned(), value);
            return Some(None);
        }
        return Some(Some(format!("let {name} = {};", value.text)));
    }
    if body.starts_with("var ") {
        return match body.split_once(" = ") {
            None => Some(Some(line.to_owned())),
            Some((start, value)) => Some(Some(format!(
                "{start} = {};",
                read(value, style, values)?.text
            ))),
        };
    }
    if let Some(at) = assignment(body) {
        let place = read(&body[..at], style, values)?;
        let value = read(&body[at + 3..], style, values)?;
        return Some(Some(format!("{};", value.assigned_to(&place.text))));
    }
    Some(Some(format!("{};", read(body, style, values)?.text)))
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
        becomes("let x = f((a < b), (c > d));", "let x = f((a < b), c > d);");
        becomes("let x = ((a & b) | c);", "let x = (a & b) | c;");
        becomes("let x = ((a << b) + 1u);", "let x = (a << b) + 1u;");
        becomes("(*p).x = (a + b).x;", "(*p).x = (a + b).x;");
    }

    #[test]
    fn changes_of_a_variable_are_short() {
        becomes("x = (x + (a + b));", "x += a + b;");
        becomes("x[i].y = (x[i].y * -(a));", "x[i].y *= -a;");
        becomes("x = ((x + a) + b);", "x = x + a + b;");
        becomes("x = (a - x);", "x = a - x;");
        becomes("x = (x & a);", "x = x & a;");
    }

    #[test]
    fn numbers_lose_suffixes_and_zeros_only() {
        becomes("let x = (a * 32f);", "let x = a * 32.0;");
        becomes("let x = (a * 0.0000000001f);", "let x = a * 1e-10;");
        becomes("let x = (a * 0.1f);", "let x = a * 0.1;");
        becomes("let x = (a + 3u);", "let x = a + 3u;");
        becomes("let x = i32(-2147483648);", "let x = i32(-2147483648);");
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
    }

    #[test]
    fn variables_are_declared_where_they_get_their_first_value() {
        becomes(
            "var x: f32;\n    var i: i32;\n    var y: f32 = 1f;\n\n    let a = (y + 1f);\n    x = a;\n    i = (i + 1i);",
            "var i: i32;\n    var y: f32 = 1.0;\n\n    let a = y + 1.0;\n    var x = a;\n    i += 1;",
        );
        becomes("var x: f32;\n\n    x = 1f;", "var x = 1.0;");
        becomes(
            "var x: f32;\n\n    if c {\n        x = 1f;\n    }",
            "var x: f32;\n\n    if c {\n        x = 1.0;\n    }",
        );
    }

    #[test]
    fn what_it_cannot_read_it_declines() {
        assert_eq!(tidy("fn f() {\n    x += 1;\n}\n", &style()), None);
    }
}
