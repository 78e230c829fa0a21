//! A small WGSL tokenizer: enough to find declarations, attributes and names by span.
//!
//! It works on text that naga has accepted, so it has no errors: what is no token of WGSL becomes a
//! symbol of one character. Symbols are single characters, since nothing here needs `<<` or `>=` as one.

use std::collections::BTreeSet;
use std::ops::Range;

/// What a token is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Kind {
    /// An identifier or a keyword.
    Word,
    /// A number with its suffix.
    Number,
    /// One character of punctuation.
    Symbol,
    /// A line comment without its line end, or a block comment with those nested in it.
    Comment,
    /// White space.
    Blank,
}

/// A token and the bytes that it covers. Tokens cover their text without gaps.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Token {
    /// What it is.
    pub(crate) kind: Kind,
    /// Its bytes.
    pub(crate) span: Range<usize>,
}

impl Token {
    /// Whether it is neither a comment nor white space.
    pub(crate) fn is_significant(&self) -> bool {
        !matches!(self.kind, Kind::Comment | Kind::Blank)
    }
}

/// Of `count` tokens, the one after the bracket that closes the one at `at`.
pub(crate) fn after_group<'t>(count: usize, at: usize, word: impl Fn(usize) -> &'t str) -> usize {
    let mut depth = 0usize;
    for token in at..count {
        match word(token) {
            "(" | "[" | "{" => depth += 1,
            ")" | "]" | "}" => {
                depth = depth.saturating_sub(1);
                if depth == 0 {
                    return token + 1;
                }
            }
            _ => {}
        }
    }
    count
}

/// White space of the WGSL specification, section 3.2.
fn is_blank(c: char) -> bool {
    matches!(
        c,
        ' ' | '\t'..='\r' | '\u{85}' | '\u{200e}' | '\u{200f}' | '\u{2028}' | '\u{2029}'
    )
}

/// The characters that end a line comment: the line breaks of the specification.
fn is_line_break(c: char) -> bool {
    matches!(c, '\n'..='\r' | '\u{85}' | '\u{2028}' | '\u{2029}')
}

/// Letters: the tables of Unicode are not needed to find where a valid identifier ends.
fn is_word_start(c: char) -> bool {
    c == '_' || c.is_ascii_alphabetic() || (!c.is_ascii() && !is_blank(c))
}

fn is_word_part(c: char) -> bool {
    is_word_start(c) || c.is_ascii_digit()
}

/// Splits a text into tokens.
pub(crate) fn tokens(text: &str) -> Vec<Token> {
    let mut out = Vec::new();
    let mut at = 0;
    while let Some(first) = text[at..].chars().next() {
        let rest = &text[at..];
        let until = |stop: fn(char) -> bool| rest.find(stop).unwrap_or(rest.len());
        let (kind, len) = if is_blank(first) {
            (Kind::Blank, until(|c| !is_blank(c)))
        } else if rest.starts_with("//") {
            (Kind::Comment, until(is_line_break))
        } else if rest.starts_with("/*") {
            (Kind::Comment, block_comment(rest))
        } else if is_word_start(first) {
            (Kind::Word, until(|c| !is_word_part(c)))
        } else if starts_number(rest) {
            (Kind::Number, number(rest))
        } else {
            (Kind::Symbol, first.len_utf8())
        };
        out.push(Token {
            kind,
            span: at..at + len,
        });
        at += len;
    }
    out
}

/// The length of the block comment that a text starts with; all of it when the comment never ends.
fn block_comment(text: &str) -> usize {
    let bytes = text.as_bytes();
    let mut depth = 0usize;
    let mut at = 0;
    while at + 1 < bytes.len() {
        match &bytes[at..at + 2] {
            b"/*" => {
                depth += 1;
                at += 2;
            }
            b"*/" => {
                depth -= 1;
                at += 2;
                if depth == 0 {
                    return at;
                }
            }
            _ => at += 1,
        }
    }
    bytes.len()
}

fn starts_number(text: &str) -> bool {
    let digits = text.strip_prefix('.').unwrap_or(text);
    digits.starts_with(|c: char| c.is_ascii_digit())
}

/// The length of the number that a text starts with: digits, letters, points, and signs of exponents.
fn number(text: &str) -> usize {
    let hex = text.starts_with("0x") || text.starts_with("0X");
    let mut before = '0';
    for (at, c) in text.char_indices() {
        let sign_of_exponent = matches!(c, '+' | '-')
            && match before {
                'e' | 'E' => !hex,
                'p' | 'P' => hex,
                _ => false,
            };
        if !(c.is_ascii_alphanumeric() || c == '.' || sign_of_exponent) {
            return at;
        }
        before = c;
    }
    text.len()
}

/// Every identifier and keyword of a text, those in comments apart.
pub(crate) fn words(text: &str) -> BTreeSet<&str> {
    tokens(text)
        .into_iter()
        .filter(|token| token.kind == Kind::Word)
        .map(|token| &text[token.span])
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn significant(text: &str) -> Vec<&str> {
        tokens(text)
            .into_iter()
            .filter(Token::is_significant)
            .map(|token| &text[token.span])
            .collect()
    }

    #[test]
    fn covers_every_byte() {
        for text in [
            "",
            "fn f() { return; } // end",
            "/* a /* b */ c */ var<private> größe: f32 = .5e-3f;\r\n\u{feff}x",
            "a/*unterminated /* nested */",
            "/",
            "/*",
        ] {
            let tokens = tokens(text);
            let mut at = 0;
            for token in &tokens {
                assert_eq!(token.span.start, at, "{text:?}");
                assert!(token.span.end > at, "{text:?}");
                at = token.span.end;
            }
            assert_eq!(at, text.len(), "{text:?}");
        }
    }

    #[test]
    fn comments_nest_and_hide_words() {
        assert_eq!(
            significant("a /* fn b /* c */ fn d */ e // fn f\n g"),
            ["a", "e", "g"]
        );
        assert_eq!(
            words("a // b\n/* c */ d").into_iter().collect::<Vec<_>>(),
            ["a", "d"]
        );
    }

    #[test]
    fn line_comments_end_at_every_kind_of_line_break() {
        for line_break in ["\n", "\r\n", "\r", "\u{85}", "\u{2028}"] {
            assert_eq!(significant(&format!("// x{line_break}y")), ["y"]);
        }
    }

    #[test]
    fn numbers_keep_their_exponents_and_leave_operators() {
        assert_eq!(
            significant("1.5e-3f+0x1.8p+3-0xe+1u .5 a.x 1-2"),
            [
                "1.5e-3f", "+", "0x1.8p+3", "-", "0xe", "+", "1u", ".5", "a", ".", "x", "1", "-",
                "2"
            ]
        );
    }

    #[test]
    fn words_may_be_of_any_script() {
        assert_eq!(significant("größe_2+Δt"), ["größe_2", "+", "Δt"]);
    }
}
