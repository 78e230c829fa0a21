//! The user's word in comments of the shader: `// lodc: keep`, `// lodc: max-error 0.01`, `// lodc: remove-first`.
//!
//! A directive is a comment that says nothing else. It is about the statement that it stands behind in its line, or else
//! about what comes next: a statement, a function, a texture or buffer. naga drops comments, so they are found here, and
//! what they are about is told by where values come from.

use super::kept::has_part;
use super::search::Ready;
use crate::Result;
use crate::emit::tokens::{Kind, Token, after_group, tokens};
use crate::front::File;
use crate::search::Kept;
use lodc_passes::Stage;
use naga::Expression;
use std::collections::BTreeSet;
use std::ops::Range;

/// What a directive asks for.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Word {
    Keep,
    MaxError(f64),
    RemoveFirst,
}

/// What a directive is about.
#[derive(Clone, Debug, PartialEq)]
enum About {
    /// A function, by its name.
    Function(String),
    /// A variable of the module.
    Variable(String),
    /// A statement.
    Statement {
        /// Its bytes.
        range: Range<usize>,
        /// The function that it is in.
        function: String,
        /// What it declares.
        declares: Option<String>,
    },
}

/// A directive in a file.
#[derive(Clone, Debug, PartialEq)]
struct Directive {
    word: Word,
    about: About,
}

/// What is wrong with a directive: its bytes, what, and the way out.
type Wrong = (Range<usize>, String, &'static str);

impl Ready {
    /// Adds what the comments of the shader's files ask for; `read` is what its fragment stage reads.
    ///
    /// # Errors
    /// At a directive that is unknown, is about nothing, or bounds an error by no number.
    pub(super) fn directives(&self, read: &BTreeSet<String>, kept: &mut Kept) -> Result<()> {
        for file in self.source.files() {
            let directives = directives(file.text).map_err(|(range, message, note)| {
                let error = self.source.error(message, file.span(range), "here");
                error.with_note(note)
            })?;
            for Directive { word, about } in directives {
                if let (Word::Keep, About::Variable(name)) = (word, &about) {
                    if read.contains(name) {
                        kept.read.insert(name.clone());
                    }
                    continue;
                }
                for path in self.values_about(&file, &about) {
                    match word {
                        Word::Keep => drop(kept.values.insert(path)),
                        Word::MaxError(most) => drop(kept.most.insert(path, most)),
                        Word::RemoveFirst => drop(kept.first.insert(path)),
                    }
                }
            }
        }
        Ok(())
    }

    /// The paths of the values that a directive is about: those that come from there, those that bear the name which is
    /// declared there, and those that functions compute which are called there.
    fn values_about(&self, file: &File<'_>, about: &About) -> Vec<String> {
        let function = self.base.function(Stage::Fragment);
        let entry = self.source.fragment.as_str();
        let functions = || {
            let functions = self.source.module.functions.iter();
            functions.filter_map(|(_, function)| function.name.as_deref())
        };
        // The entry point of GLSL goes by another name here.
        let renamed = |name| match name == "main" && functions().all(|other| other != name) {
            true => entry,
            false => name,
        };
        let called: Vec<&str> = match about {
            About::Statement { range, .. } => {
                let text = &file.text[range.clone()];
                let words = tokens(text);
                let words: Vec<&str> = words.iter().map(|t| &text[t.span.clone()]).collect();
                functions().filter(|name| words.contains(name)).collect()
            }
            _ => Vec::new(),
        };
        self.computed()
            .filter(|(value, path)| match about {
                About::Function(name) => renamed(name) == entry || has_part(path, &[name]),
                About::Variable(name) => {
                    let loads = |f: &naga::Function| {
                        matches!(f.expressions[*value], Expression::Load { .. })
                    };
                    function.is_some_and(loads) && has_part(path, &[name])
                }
                About::Statement {
                    range,
                    function: inside,
                    declares,
                } => {
                    let inside = renamed(inside);
                    let span = function.map(|f| f.expressions.get_span(*value));
                    let place = span.and_then(|span| self.source.place(span));
                    let from_there = place.is_some_and(|place| {
                        place.file.start == file.start
                            && range.start <= place.range.start
                            && place.range.end <= range.end
                    });
                    from_there
                        || declares
                            .as_ref()
                            .is_some_and(|name| has_part(path, &[inside, name]))
                        || called
                            .iter()
                            .any(|called| has_part(path, &[inside, called]))
                }
            })
            .map(|(_, path)| path.to_owned())
            .collect()
    }
}

/// The directives of a text, in order.
fn directives(text: &str) -> std::result::Result<Vec<Directive>, Wrong> {
    let all = tokens(text);
    let code = Code {
        text,
        tokens: all.iter().filter(|token| token.is_significant()).collect(),
    };
    let mut found = Vec::new();
    for token in &all {
        if token.kind != Kind::Comment {
            continue;
        }
        let Some(words) = said(&text[token.span.clone()]) else {
            continue;
        };
        let word = word(&words).map_err(|(message, note)| (token.span.clone(), message, note))?;
        let about = code.about_comment(&token.span).ok_or_else(|| {
            let message = "this directive is about nothing".to_owned();
            (
                token.span.clone(),
                message,
                "it goes behind a statement in its line, or in front of a statement, a function, a texture or a buffer",
            )
        })?;
        found.push(Directive { word, about });
    }
    Ok(found)
}

/// What a comment says behind `lodc:`.
fn said(comment: &str) -> Option<Vec<&str>> {
    let inside = comment.strip_prefix("//").or_else(|| {
        let inside = comment.strip_prefix("/*")?;
        Some(inside.strip_suffix("*/").unwrap_or(inside))
    })?;
    let inside = inside.trim_start_matches(['/', '*', '!']).trim();
    Some(inside.strip_prefix("lodc:")?.split_whitespace().collect())
}

/// Reads a directive's words.
fn word(words: &[&str]) -> std::result::Result<Word, (String, &'static str)> {
    match words {
        ["keep"] => Ok(Word::Keep),
        ["remove-first"] => Ok(Word::RemoveFirst),
        ["max-error", number] => match number.parse::<f64>() {
            Ok(most) if most >= 0.0 && most.is_finite() => Ok(Word::MaxError(most)),
            _ => Err((
                format!("`{number}` is no error"),
                "an error is a number from 0 to 1, such as `max-error 0.01`",
            )),
        },
        ["max-error", ..] => Err((
            "`max-error` takes one number".into(),
            "such as `// lodc: max-error 0.01`",
        )),
        _ => Err((
            format!("unknown directive `{}`", words.join(" ")),
            "the directives are `keep`, `max-error NUMBER` and `remove-first`",
        )),
    }
}

/// The tokens of a text that are no comments, cut into declarations and statements. WGSL and GLSL do that alike.
struct Code<'a> {
    text: &'a str,
    tokens: Vec<&'a Token>,
}

impl Code<'_> {
    fn word(&self, at: usize) -> &str {
        let token = self.tokens.get(at);
        token.map_or("", |token| &self.text[token.span.clone()])
    }

    fn is_word(&self, at: usize) -> bool {
        let token = self.tokens.get(at);
        token.is_some_and(|token| token.kind == Kind::Word)
    }

    /// What a comment at these bytes is about.
    fn about_comment(&self, place: &Range<usize>) -> Option<About> {
        let mut tokens = self.tokens.iter();
        let next = tokens.position(|token| token.span.start >= place.end);
        let before = next.unwrap_or(self.tokens.len()).checked_sub(1);
        let in_line = before.filter(|at| {
            let between = &self.text[self.tokens[*at].span.end..place.start];
            !between.contains(['\n', '\r'])
        });
        // What ends behind the comment is nothing that comes next.
        let target = in_line.or_else(|| next.filter(|at| self.word(*at) != "}"))?;
        self.about(target)
    }

    /// What the innermost statement, or else the declaration, is that a token is in.
    fn about(&self, target: usize) -> Option<About> {
        let mut start = 0;
        while self.end(start) <= target {
            start = self.end(start);
        }
        let end = self.end(start);
        let first = self.behind_attributes(start);
        let Some(name) = self.function(first, end) else {
            let name = match self.word(first) {
                "var" => self.declared(first)?,
                // GLSL has the name at the end.
                _ if (first..end).any(|at| self.word(at) == "uniform") => {
                    self.word(end.checked_sub(2)?).to_owned()
                }
                _ => return None,
            };
            return Some(About::Variable(name));
        };
        let Some((start, end)) = self.statement((start, end), target) else {
            return Some(About::Function(name));
        };
        let first = self.behind_attributes(start);
        Some(About::Statement {
            range: self.tokens[start].span.start..self.tokens[end - 1].span.end,
            function: name,
            declares: match self.word(first) {
                "let" | "var" | "const" => self.declared(first),
                // In GLSL a type stands in front: `vec3 n = ...`.
                _ if self.is_word(first + 1) && self.word(first + 2) == "=" => {
                    Some(self.word(first + 1).to_owned())
                }
                _ => None,
            },
        })
    }

    /// The innermost statement with a token, in the blocks of what goes from one token to before another.
    fn statement(&self, (start, end): (usize, usize), target: usize) -> Option<(usize, usize)> {
        let mut at = start;
        while at < end {
            if self.word(at) != "{" {
                at += 1;
                continue;
            }
            let close = self.after_group(at);
            if at < target && target + 1 < close {
                let mut inner = at + 1;
                while self.end(inner) <= target {
                    inner = self.end(inner);
                }
                let found = (inner, self.end(inner));
                return self.statement(found, target).or(Some(found));
            }
            at = close;
        }
        None
    }

    /// The name of the function that a declaration is.
    fn function(&self, first: usize, end: usize) -> Option<String> {
        if self.word(first) == "fn" {
            return Some(self.word(first + 1).to_owned());
        }
        // GLSL: a name, parameters, and a body right behind them.
        let opens = (first..end).find(|at| self.word(*at) == "(")?;
        let is_function = opens > first && self.word(self.after_group(opens)) == "{";
        is_function.then(|| self.word(opens - 1).to_owned())
    }

    /// What a declaration that begins with a keyword declares.
    fn declared(&self, keyword: usize) -> Option<String> {
        let mut at = keyword + 1;
        if self.word(at) == "<" {
            while !["", ">"].contains(&self.word(at)) {
                at += 1;
            }
            at += 1;
        }
        Some(self.word(at).to_owned()).filter(|name| !name.is_empty())
    }

    fn behind_attributes(&self, mut at: usize) -> usize {
        while self.word(at) == "@" {
            at += 2;
            if self.word(at) == "(" {
                at = self.after_group(at);
            }
        }
        at
    }

    /// The token behind the declaration or statement that starts at one: behind its `;`, or its last block.
    fn end(&self, start: usize) -> usize {
        let mut at = start;
        while at < self.tokens.len() {
            match self.word(at) {
                ";" => return at + 1,
                "{" => {
                    at = self.after_group(at);
                    let goes_on = self.word(at) == "else" || self.word(start) == "do";
                    if !goes_on {
                        return at;
                    }
                }
                "(" | "[" => at = self.after_group(at),
                "}" if at > start => return at,
                _ => at += 1,
            }
        }
        self.tokens.len().max(start + 1)
    }

    /// The token behind the bracket that closes the one at a place.
    fn after_group(&self, at: usize) -> usize {
        after_group(self.tokens.len(), at, |token| self.word(token))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::compile::Request;

    const TEXT: &str = "\
/* lodc: keep */ @group(0) @binding(1) var albedo: texture_2d<f32>;
// lodc: remove-first
fn rim(x: f32) -> f32 { // a remark /* with another */
    return pow(x, 4.0); // lodc: max-error 0.01
}
@fragment
fn fs_main(@location(0) uv: vec2f) -> @location(0) vec4f { // lodc: keep
    /* an /* inner // lodc: forget
       */ remark: lodc: keep */
    var sum = 0.0;
    // lodc: keep

    // Why it is so.
    let edge = rim(uv.x);
    for (var i = 0; i < 4; i++) { // lodc: remove-first
        if uv.y > 0.5 {
            sum += edge; /// lodc: keep
        } else { sum -= 1.0; } // lodc: max-error 0
    }
    return vec4f(sum);
}
";

    #[test]
    fn directives_are_about_what_stands_before_or_behind_them() {
        let found = directives(TEXT).expect("all are known");
        let said: Vec<(Word, String)> = found
            .into_iter()
            .map(|Directive { word, about }| {
                let about = match about {
                    About::Function(name) => format!("fn {name}"),
                    About::Variable(name) => format!("var {name}"),
                    About::Statement {
                        range,
                        function,
                        declares,
                    } => {
                        let text = TEXT[range].split_whitespace().collect::<Vec<_>>();
                        format!("{function} {declares:?} {}", text.join(" "))
                    }
                };
                (word, about)
            })
            .collect();
        let loop_ = "fs_main None for (var i = 0; i < 4; i++) { // lodc: remove-first if uv.y > 0.5 { \
                     sum += edge; /// lodc: keep } else { sum -= 1.0; } // lodc: max-error 0 }";
        let branch =
            "fs_main None if uv.y > 0.5 { sum += edge; /// lodc: keep } else { sum -= 1.0; }";
        let expected = [
            (Word::Keep, "var albedo"),
            (Word::RemoveFirst, "fn rim"),
            (Word::MaxError(0.01), "rim None return pow(x, 4.0);"),
            (Word::Keep, "fn fs_main"),
            (Word::Keep, "fs_main Some(\"edge\") let edge = rim(uv.x);"),
            (Word::RemoveFirst, loop_),
            (Word::Keep, "fs_main None sum += edge;"),
            (Word::MaxError(0.0), branch),
        ];
        let expected = expected.map(|(word, about)| (word, about.to_owned()));
        assert_eq!(said, expected);
    }

    /// A shader in its scene.
    fn ready(text: &str) -> Ready {
        let source = crate::front::Source::parse("marked.wgsl", text).expect("it parses");
        let scene = "resolution = [32, 32]\nlevels = 3\ne_max = 0.2";
        let path = std::path::Path::new("marked.toml");
        let scene = crate::scene::Scene::resolve(&source, Some((path, scene)));
        Ready {
            request: crate::compile::Request::default(),
            base: crate::compile::normal_form(&source).expect("it is small"),
            scene: scene.unwrap_or_else(|e| panic!("{e}")),
            scene_file: None,
            source,
        }
    }

    const MARKED: &str = "
        fn wave(x: f32) -> f32 { let turned = sin(x * 7.0); return turned * turned; }
        @fragment fn fs_main(@location(0) uv: vec2f) -> @location(0) vec4f {
            let rim = pow(uv.x, 4.0) + 0.2 * uv.y; // keep
            let glow = exp(uv.y) * 0.1; // most
            // first
            let ripple = wave(uv.x + uv.y) * 0.1;
            return vec4f(rim, glow, ripple, 1.0);
        }";

    #[test]
    fn a_statement_has_what_it_computes_declares_and_calls() {
        let text = MARKED.replace("// keep", "// lodc: keep");
        let text = text.replace("// most", "// lodc: max-error 0.02");
        let text = text.replace("// first", "// lodc: remove-first");
        let kept = ready(&text)
            .kept(&Request::default())
            .expect("they are known");
        for path in ["fs_main.rim", "fs_main.rim.pow"] {
            assert!(kept.values.contains(path), "{kept:?}");
        }
        assert_eq!(kept.most.get("fs_main.glow"), Some(&0.02), "{kept:?}");
        assert!(!kept.most.contains_key("fs_main.rim"));
        for path in ["fs_main.ripple", "fs_main.wave.turned"] {
            assert!(kept.first.contains(path), "{kept:?}");
        }
        assert!(kept.read.is_empty());
    }

    #[test]
    fn what_is_marked_stays_in_every_level() {
        use crate::search::{Scope, find};
        use lodc_passes::ValueId;
        let levels = |text: &str| {
            let ready = ready(text);
            let vertex = ready.vertex().expect("lodc supplies one");
            let stand = ready.stand(&vertex);
            let kept = ready.kept(&Request::default()).expect("they are known");
            let found = find(&stand, (Scope::Levels, &kept), None, &|_| {}).expect("it runs");
            assert!(found.levels.len() > 1, "there is no level");
            let rim = ValueId::from("fs_main.rim.pow");
            let of = |level: &crate::search::Level| level.shader.find(&rim).is_some();
            found.levels.iter().map(of).collect::<Vec<_>>()
        };
        assert!(levels(MARKED).contains(&false));
        let marked = MARKED.replace("// keep", "// lodc: keep");
        assert!(!levels(&marked).contains(&false));
    }

    #[test]
    fn glsl_has_no_words_in_front_of_what_it_declares() {
        let text = "#version 450
layout(set = 0, binding = 1) uniform texture2D albedo; // lodc: keep
vec3 lit(vec3 n) {
    vec3 light = n * 2.0; // lodc: keep
    return light;
}";
        let found = directives(text).expect("all are known");
        let about: Vec<About> = found.into_iter().map(|found| found.about).collect();
        assert_eq!(about[0], About::Variable("albedo".into()));
        assert!(
            matches!(&about[1], About::Statement { function, declares: Some(name), .. }
                if function == "lit" && name == "light"),
            "{about:?}"
        );
    }

    #[test]
    fn what_is_no_directive_is_said() {
        for (text, part) in [
            ("fn f() {} // lodc: kep", "unknown directive `kep`"),
            ("fn f() {} // lodc:", "unknown directive ``"),
            ("fn f() {} // lodc: max-error", "takes one number"),
            ("fn f() {} // lodc: max-error -1", "`-1` is no error"),
            ("fn f() {}\n// lodc: keep\n", "about nothing"),
            ("// lodc: keep\nstruct S { x: f32 }", "about nothing"),
            ("fn f() { let x = 1.0;\n // lodc: keep\n }", "about nothing"),
        ] {
            let (range, message, _) = directives(text).expect_err("it is wrong");
            assert!(message.contains(part), "{message}");
            assert!(text[range].starts_with("// lodc:"), "{text}");
        }
    }
}
