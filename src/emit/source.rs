//! The author's WGSL text: its declarations, its entry points, and the edits that turn one of them
//! into an ordinary function. Everything else of the text stays as it is, byte for byte.

use super::tidy::is_generic;
use super::tokens::{Kind, Token, after_group, tokens, words};
use std::collections::{BTreeMap, BTreeSet};
use std::ops::Range;

/// The keyword that a module-scope declaration starts with.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Keyword {
    Fn,
    Struct,
    Const,
    Override,
    Var,
    Alias,
}

/// A declaration at module scope.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Declaration {
    pub(crate) keyword: Keyword,
    pub(crate) name: String,
    /// The bytes of the name.
    pub(crate) name_span: Range<usize>,
    /// From the first attribute to the closing `;` or `}`.
    pub(crate) span: Range<usize>,
    /// The same as a range of [`Text::tokens`].
    tokens: Range<usize>,
}

/// A WGSL text and what is known of it without parsing expressions.
#[derive(Clone, Debug)]
pub(crate) struct Text<'a> {
    /// The text, without a byte-order mark.
    pub(crate) text: &'a str,
    /// Every token that is neither blank nor comment.
    tokens: Vec<Token>,
    /// Every identifier and keyword in it, at any scope.
    pub(crate) words: BTreeSet<&'a str>,
    /// What it declares at module scope, in order.
    pub(crate) declarations: Vec<Declaration>,
    /// `enable`, `requires` and `diagnostic` directives, each with its semicolon.
    pub(crate) directives: Vec<&'a str>,
    /// Its line end.
    pub(crate) line_end: &'static str,
}

/// A function's signature, by span.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Signature {
    /// From the first attribute to before the body, without trailing comments and blanks.
    pub(crate) span: Range<usize>,
    /// The name.
    pub(crate) name: Range<usize>,
    /// The names of the parameters.
    pub(crate) parameters: Vec<Range<usize>>,
    /// Where further parameters go: behind all that stands between the brackets.
    further: usize,
    /// What stands between parameters, and what in front of the first further one.
    separators: [String; 2],
    /// What it returns, with its attributes.
    pub(crate) result: Option<Range<usize>>,
    /// Each attribute, as the spans of its tokens.
    attributes: Vec<Vec<Range<usize>>>,
}

impl<'a> Text<'a> {
    /// Reads a text that naga has accepted.
    pub(crate) fn new(text: &'a str) -> Self {
        let text = text.strip_prefix('\u{feff}').unwrap_or(text);
        let mut read = Self {
            text,
            tokens: tokens(text)
                .into_iter()
                .filter(Token::is_significant)
                .collect(),
            words: words(text),
            declarations: Vec::new(),
            directives: Vec::new(),
            line_end: match text.find('\n') {
                Some(at) if text[..at].ends_with('\r') => "\r\n",
                _ => "\n",
            },
        };
        read.read_declarations();
        read
    }

    fn word(&self, token: usize) -> &'a str {
        self.tokens
            .get(token)
            .map_or("", |token| &self.text[token.span.clone()])
    }

    fn is_word(&self, token: usize) -> bool {
        self.tokens
            .get(token)
            .is_some_and(|token| token.kind == Kind::Word)
    }

    fn read_declarations(&mut self) {
        let mut at = 0;
        while at < self.tokens.len() {
            let start = at;
            while self.word(at) == "@" {
                at = self.after_attribute(at);
            }
            let keyword = match self.word(at) {
                "fn" => Some(Keyword::Fn),
                "struct" => Some(Keyword::Struct),
                "const" => Some(Keyword::Const),
                "override" => Some(Keyword::Override),
                "var" => Some(Keyword::Var),
                "alias" => Some(Keyword::Alias),
                _ => None,
            };
            let directive =
                start == at && matches!(self.word(at), "enable" | "requires" | "diagnostic");
            let end = self.after_item(at);
            let span = self.tokens[start].span.start..self.tokens[end - 1].span.end;
            if directive {
                self.directives.push(&self.text[span]);
            } else if let Some(keyword) = keyword {
                let mut name = at + 1;
                if keyword == Keyword::Var && self.word(name) == "<" {
                    while name < end && self.word(name) != ">" {
                        name += 1;
                    }
                    name += 1;
                }
                if name < end && self.is_word(name) {
                    self.declarations.push(Declaration {
                        keyword,
                        name: self.word(name).to_owned(),
                        name_span: self.tokens[name].span.clone(),
                        span,
                        tokens: start..end,
                    });
                }
            }
            at = end;
        }
    }

    /// The token after the attribute at `at`.
    fn after_attribute(&self, at: usize) -> usize {
        let name = at + 1;
        if self.word(name + 1) == "(" {
            self.after_group(name + 1)
        } else {
            name + 1
        }
    }

    /// The token after the bracket that closes the one at `at`.
    fn after_group(&self, at: usize) -> usize {
        after_group(self.tokens.len(), at, |token| self.word(token))
    }

    /// The token after the item at `at`: after its `;`, or after its body and the `;` that may follow it.
    fn after_item(&self, mut at: usize) -> usize {
        while at < self.tokens.len() {
            match self.word(at) {
                ";" => return at + 1,
                "{" => return self.after_group(at),
                "(" | "[" => at = self.after_group(at),
                _ => at += 1,
            }
        }
        self.tokens.len()
    }

    /// The text with names of module scope replaced. A local of such a name gets the new one too, since it is one
    /// there for all that reads it; members, attributes' words, directives and address spaces are something else.
    pub(crate) fn renamed(&self, names: &BTreeMap<String, String>) -> String {
        let mut out = String::with_capacity(self.text.len());
        let mut copied = 0;
        let mut at = 0;
        let is_in_struct = |place: usize| {
            let mut structs = self
                .declarations
                .iter()
                .filter(|d| d.keyword == Keyword::Struct);
            structs.any(|d| d.tokens.contains(&place))
        };
        while at < self.tokens.len() {
            match self.word(at) {
                "@" if matches!(self.word(at + 1), "builtin" | "interpolate" | "diagnostic") => {
                    at = self.after_attribute(at);
                    continue;
                }
                "@" | "." => {
                    at += 2;
                    continue;
                }
                "enable" | "requires" | "diagnostic" if self.is_word(at) => {
                    at = self.after_item(at);
                    continue;
                }
                "var" if self.word(at + 1) == "<" => {
                    while at < self.tokens.len() && self.word(at) != ">" {
                        at += 1;
                    }
                }
                _ => {}
            }
            let is_member = self.word(at + 1) == ":" && is_in_struct(at);
            if let Some(name) = names.get(self.word(at)).filter(|_| !is_member) {
                let span = &self.tokens[at].span;
                out.push_str(&self.text[copied..span.start]);
                out.push_str(name);
                copied = span.end;
            }
            at += 1;
        }
        out.push_str(&self.text[copied..]);
        out
    }

    /// Whether its author writes `vec3f` rather than `vec3<f32>`, or neither.
    pub(crate) fn uses_short_types(&self) -> bool {
        !(0..self.tokens.len()).any(|at| is_generic(self.word(at)) && self.word(at + 1) == "<")
    }

    /// The declaration of a name at module scope.
    pub(crate) fn declaration(&self, name: &str) -> Option<&Declaration> {
        self.declarations.iter().find(|d| d.name == name)
    }

    /// The signature of a function.
    pub(crate) fn signature(&self, name: &str) -> Option<Signature> {
        let declaration = self
            .declarations
            .iter()
            .find(|d| d.keyword == Keyword::Fn && d.name == name)?;
        let all = declaration.tokens.clone();
        let mut attributes = Vec::new();
        let mut parameters = Vec::new();
        let mut result = None;
        let mut brackets = None;
        let mut depth = 0usize;
        let mut at = all.start;
        while at < all.end && self.word(at) != "{" {
            match self.word(at) {
                "@" => {
                    let end = self.after_attribute(at).min(all.end);
                    attributes.push((at..end).map(|t| self.tokens[t].span.clone()).collect());
                    at = end;
                    continue;
                }
                "(" if depth == 0 => {
                    brackets = Some((at, self.after_group(at) - 1));
                    depth = 1;
                }
                "(" | "[" => depth += 1,
                ")" | "]" => depth = depth.saturating_sub(1),
                "-" if depth == 0 && self.word(at + 1) == ">" => result = Some(at + 2),
                ":" if depth == 1 => parameters.push(self.tokens[at - 1].span.clone()),
                _ => {}
            }
            at += 1;
        }
        let end = self.tokens[at - 1].span.end;
        let (open, close) = brackets?;
        let further = self.tokens[close - 1].span.end;
        // Where the author gives each parameter a line, further ones get one each.
        let before = &self.text[self.tokens[open].span.end..self.tokens[open + 1].span.start];
        let blank = match before.rfind('\n') {
            Some(line) if close > open + 1 => {
                let blank = &before[line..];
                &blank[..blank.len() - blank.trim_start().len()]
            }
            _ => " ",
        };
        let first = match self.word(close - 1) {
            "(" => String::new(),
            "," => blank.to_owned(),
            _ => format!(",{blank}"),
        };
        Some(Signature {
            span: self.tokens[all.start].span.start..end,
            name: declaration.name_span.clone(),
            parameters,
            further,
            separators: [format!(",{blank}"), first],
            result: result.map(|result| self.tokens[result].span.start..end),
            attributes,
        })
    }

    /// The text with functions made ordinary ones: their names replaced, and every attribute of their signatures
    /// taken off that belongs to entry points. Line ends and comments stay, so that every line keeps its number.
    pub(crate) fn demoted(&self, functions: &[(&Signature, &str)]) -> String {
        let mut out = String::with_capacity(self.text.len());
        let mut at = 0;
        let mut edits: BTreeMap<usize, (Range<usize>, &str)> = BTreeMap::new();
        for (signature, name) in functions {
            edits.insert(signature.name.start, (signature.name.clone(), name));
            for attribute in &signature.attributes {
                let kept = attribute.get(1).is_some_and(|word| {
                    matches!(&self.text[word.clone()], "diagnostic" | "must_use")
                });
                if kept {
                    continue;
                }
                for token in attribute {
                    let after = &self.text[token.end..];
                    let blanks = after.len() - after.trim_start_matches([' ', '\t']).len();
                    edits.insert(token.start, (token.start..token.end + blanks, ""));
                }
            }
        }
        for (span, with) in edits.into_values() {
            out.push_str(&self.text[at..span.start]);
            out.push_str(with);
            at = span.end;
        }
        out.push_str(&self.text[at..]);
        out
    }

    /// What a function's text lets pass for derivatives in control flow that is not uniform: the most
    /// lenient `@diagnostic(severity, derivative_uniformity)` in the text, at any place. Level functions
    /// hold code from all over the text, so they carry it.
    pub(crate) fn derivative_attribute(&self) -> Option<String> {
        let lenience = ["error", "warning", "info", "off"];
        (0..self.tokens.len())
            .filter(|at| {
                self.word(*at) == "@"
                    && self.word(at + 1) == "diagnostic"
                    && self.word(at + 2) == "("
                    && self.word(at + 5) == "derivative_uniformity"
            })
            .filter_map(|at| lenience.iter().position(|word| *word == self.word(at + 3)))
            .max()
            .map(|found| format!("@diagnostic({}, derivative_uniformity)", lenience[found]))
    }
}

impl Signature {
    /// The signature as it stands, but for the parameters' names, with further parameters behind, and with another
    /// result where one is given.
    pub(crate) fn with(
        &self,
        text: &Text<'_>,
        names: &[String],
        further: &[&str],
        result: Option<&str>,
    ) -> String {
        let mut out = String::new();
        let mut at = self.span.start;
        for (parameter, name) in self.parameters.iter().zip(names) {
            out.push_str(&text.text[at..parameter.start]);
            out.push_str(name);
            at = parameter.end;
        }
        if !further.is_empty() {
            let [between, first] = &self.separators;
            out.push_str(&text.text[at..self.further]);
            out.push_str(first);
            out.push_str(&further.join(between));
            at = self.further;
        }
        match (&self.result, result) {
            (Some(old), Some(new)) => {
                out.push_str(&text.text[at..old.start]);
                out.push_str(new);
            }
            _ => out.push_str(&text.text[at..self.span.end]),
        }
        out
    }

    /// The names of the parameters.
    pub(crate) fn names<'a>(&self, text: &Text<'a>) -> Vec<&'a str> {
        let parameters = self.parameters.iter();
        parameters.map(|name| &text.text[name.clone()]).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn demoted(text: &str) -> String {
        let text = Text::new(text);
        let signature = text.signature("main").expect("it is there");
        text.demoted(&[(&signature, "original_main")])
    }

    #[test]
    fn takes_off_stage_and_io_attributes_alone() {
        assert_eq!(
            demoted(
                "@diagnostic(off, derivative_uniformity) @fragment fn main(@location(0) @interpolate(flat, either) id: u32, \
                 @builtin(position) p: vec4<f32>) -> @location(0) vec4f { return p; }"
            ),
            "@diagnostic(off, derivative_uniformity) fn original_main(id: u32, p: vec4<f32>) -> vec4f { return p; }"
        );
    }

    #[test]
    fn finds_attributes_in_odd_orders_and_layouts() {
        assert_eq!(
            demoted(
                "@early_depth_test(less_equal)\n@ fragment // why\n/* fn no() */ fn\nmain() { }"
            ),
            "\n// why\n/* fn no() */ fn\noriginal_main() { }"
        );
        assert_eq!(
            demoted("@fragment fn main(@location /* slot */ (0,) a: f32) {}"),
            "fn original_main(/* slot */ a: f32) {}"
        );
    }

    #[test]
    fn leaves_comments_other_functions_and_line_ends() {
        let text = "// @fragment fn main()\r\n/* fn main */\r\nfn mainly() {}\r\n@fragment\r\nfn main() {\r\n  let main_ = 1;\r\n}";
        let after = demoted(text);
        assert_eq!(
            after,
            "// @fragment fn main()\r\n/* fn main */\r\nfn mainly() {}\r\n\r\nfn original_main() {\r\n  let main_ = 1;\r\n}"
        );
        assert_eq!(Text::new(text).line_end, "\r\n");
    }

    #[test]
    fn a_byte_order_mark_is_no_part_of_the_text() {
        let text = Text::new("\u{feff}@fragment fn main() {}");
        assert_eq!(text.declarations[0].span, 0..22);
    }

    #[test]
    fn reads_declarations_with_templates_and_initialisers() {
        let text = Text::new(
            "enable f16; diagnostic(off, derivative_uniformity);
            alias A = vec4<f32>; struct S { a: A, b: f32, }; const_assert 1 < 2;
            @group(0) @binding(1) var<storage, read> data: array<S, 4>; @id(3) override gain = 1.0;
            const größe = array(1, 2)[1]; var<private> last: f32;
            @must_use fn f(a: ptr<function, S>) -> f32 { if (a.b < 1.0) { return 1.0; } return 2.0; }
            ; fn g() {} ",
        );
        let names: Vec<_> = text
            .declarations
            .iter()
            .map(|d| (d.keyword, d.name.as_str()))
            .collect();
        assert_eq!(
            names,
            [
                (Keyword::Alias, "A"),
                (Keyword::Struct, "S"),
                (Keyword::Var, "data"),
                (Keyword::Override, "gain"),
                (Keyword::Const, "größe"),
                (Keyword::Var, "last"),
                (Keyword::Fn, "f"),
                (Keyword::Fn, "g"),
            ]
        );
        assert_eq!(
            text.directives,
            ["enable f16;", "diagnostic(off, derivative_uniformity);"]
        );
    }

    #[test]
    fn signatures_know_parameters_and_results() {
        let text = Text::new(
            "@fragment fn main(@location(0) a: array<vec2<f32>, 2>, @builtin(front_facing) b: bool,) // no { here\n{ }",
        );
        let signature = text.signature("main").expect("it is there");
        assert_eq!(signature.names(&text), ["a", "b"]);
        assert_eq!(signature.result, None);
        assert_eq!(
            signature.with(&text, &["c".to_owned(), "b".to_owned()], &[], None),
            "@fragment fn main(@location(0) c: array<vec2<f32>, 2>, @builtin(front_facing) b: bool,)"
        );
    }

    #[test]
    fn signatures_take_further_parameters_and_another_result() {
        for (text, wanted) in [
            ("fn main() {}", "fn main(x: f32, y: f32)"),
            (
                "fn main() -> @location(0) vec4<f32> {}",
                "fn main(x: f32, y: f32) -> R",
            ),
            (
                "fn main(a: f32 /* of */) -> f32 {}",
                "fn main(a: f32, x: f32, y: f32 /* of */) -> R",
            ),
            (
                "fn main(@builtin(position) a: vec4f,)->@builtin(position) vec4f {}",
                "fn main(@builtin(position) a: vec4f, x: f32, y: f32)->R",
            ),
            (
                "fn main(\n  a: f32,\n  b: f32 // last\n) -> f32 {}",
                "fn main(\n  a: f32,\n  b: f32,\n  x: f32,\n  y: f32 // last\n) -> R",
            ),
            (
                "fn main(\n\ta: f32,\n) {}",
                "fn main(\n\ta: f32,\n\tx: f32,\n\ty: f32\n)",
            ),
        ] {
            let text = Text::new(text);
            let signature = text.signature("main").expect("it is there");
            let names: Vec<String> = signature.names(&text).iter().map(|n| (*n).into()).collect();
            let further = ["x: f32", "y: f32"];
            assert_eq!(signature.with(&text, &names, &further, Some("R")), wanted);
        }
    }

    #[test]
    fn renames_what_a_declaration_means_and_no_namesake() {
        let text = Text::new(
            "enable mix; // mix
            struct S { @builtin(mix) @location(mix) mix: f32, b: mix }
            var<mix> mix: S; fn f(mix: S) -> f32 { let a = s.mix + mix.mix; return mix(a, .5); }",
        );
        let names = BTreeMap::from([("mix".to_owned(), "mix_b".to_owned())]);
        assert_eq!(
            text.renamed(&names),
            "enable mix; // mix
            struct S { @builtin(mix) @location(mix_b) mix: f32, b: mix_b }
            var<mix> mix_b: S; fn f(mix_b: S) -> f32 { let a = s.mix + mix_b.mix; return mix_b(a, .5); }"
        );
    }

    #[test]
    fn the_most_lenient_diagnostic_wins() {
        let text = Text::new(
            "@diagnostic(warning, derivative_uniformity) fn a() {} fn b() { @diagnostic(off, derivative_uniformity) if true {} }",
        );
        assert_eq!(
            text.derivative_attribute().as_deref(),
            Some("@diagnostic(off, derivative_uniformity)")
        );
        assert_eq!(Text::new("fn a() {}").derivative_attribute(), None);
    }
}
