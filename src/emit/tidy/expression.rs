//! Expressions of the writer's form, with the parentheses and suffixes that they need and no others.

use super::Style;
use crate::emit::tokens::{Kind, tokens};
use std::collections::BTreeMap;

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
    /// `<`: in an argument list it could be read as the start of a template's arguments.
    Less,
    /// `>`, `<=` and `>=`.
    Order,
    /// `&&` or `||`.
    Logic(char),
}

/// An expression as it is written.
#[derive(Clone, Debug)]
pub(super) struct Written {
    pub(super) text: String,
    level: Level,
    /// Of two operands with an arithmetic operator between them: the left one, and `+= right`.
    update: Option<(String, String)>,
}

impl Written {
    /// The assignment of this to a place, with `+=` and the like where it adds to what is there.
    pub(super) fn assigned_to(self, place: &str) -> String {
        match self.update {
            Some((left, change)) if left == place => format!("{place} {change}"),
            _ => format!("{place} = {}", self.text),
        }
    }

    fn primary(text: String) -> Self {
        Self {
            text,
            level: Level::Primary,
            update: None,
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

/// Reads expressions of the writer's form.
struct Reader<'a> {
    text: &'a str,
    at: usize,
    style: &'a Style,
    values: &'a BTreeMap<String, Written>,
}

/// Reads a text that is one expression. `values` are names that are replaced.
pub(super) fn read(
    text: &str,
    style: &Style,
    values: &BTreeMap<String, Written>,
) -> Option<Written> {
    let mut reader = Reader {
        text,
        at: 0,
        style,
        values,
    };
    let written = reader.expression()?;
    (reader.at == text.len()).then_some(written)
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
                update: None,
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
        let fits = written.level != Level::Less;
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
        "<" => Less,
        "<=" | ">" | ">=" => Order,
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
        Equality | Less | Order => alone(operand) || matches!(operand, Product | Sum),
        Bits('<' | '>') => alone(operand),
        _ => alone(operand) || (is_left && operand == level),
    };
    let (left_fits, right_fits) = (fits(left.level, true), fits(right.level, false));
    let update = matches!(operator, "+" | "-" | "*" | "/")
        .then(|| (left.text.clone(), format!("{operator}= {}", right.text)));
    Written {
        update,
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
        Some((digits, Ok(value))) if !digits.starts_with("0x") => format!("{}f", decimal(value)),
        _ => word.to_owned(),
    }
}

/// The shortest decimal that is read back as the same number. The largest one's is above it before it is
/// rounded, which Tint refuses: that one is written in full.
fn decimal(value: f32) -> String {
    if value.abs() == f32::MAX {
        return format!("{:?}", f64::from(value));
    }
    format!("{value:?}")
}

/// A number without the suffix that its type can do without.
fn bare_number(word: &str) -> String {
    if let Some(digits) = word.strip_suffix('f')
        && !digits.starts_with("0x")
        && let Ok(value) = digits.parse::<f32>()
    {
        let text = decimal(value);
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_keep_their_value() {
        assert_eq!(plain_number("32f"), "32.0f");
        assert_eq!(plain_number("2i"), "2i");
        assert_eq!(bare_number("0.1f"), "0.1");
        assert_eq!(bare_number("16777216f"), "16777216.0");
        assert_eq!(bare_number("7h"), "7h");
        let largest = "340282350000000000000000000000000000000f";
        assert_eq!(bare_number(largest), "3.4028234663852886e38");
        assert_eq!(plain_number(largest), "3.4028234663852886e38f");
    }
}
