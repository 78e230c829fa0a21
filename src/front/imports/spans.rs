//! Spans of naga_oil led back to the files that people wrote.
//!
//! naga_oil gives naga a text of its own for every module: headers of what it imports, then the module's text
//! with directives taken out, shader defs put in and imported names mangled. A span counts in that text, and
//! has the module's number in its upper bits. The headers' length is told only of a text that has a flaw, so that
//! each is given one on purpose. Lines stay lines, and words stay words.

use super::library::Library;
use super::{Definitions, Main};
use naga::Span;
use naga_oil::compose::preprocess::Preprocessor;
use naga_oil::compose::{
    Composer, ComposerErrorInner, ErrSource, NagaModuleDescriptor, ShaderType,
};
use std::collections::BTreeMap;
use std::ops::Range;

/// Where naga_oil keeps the number of a module in a span.
const SHIFT: usize = 21;

/// The spans of a composed module.
pub(in crate::front) struct Spans {
    /// By naga_oil's number; 0 is the text that was composed.
    modules: BTreeMap<usize, Mapped>,
}

/// The text of one module as naga saw it.
struct Mapped {
    /// The length of what stands before the module's own text.
    header: usize,
    words: Words,
    /// The offset at which spans into the file begin.
    start: usize,
}

impl Spans {
    pub(super) fn new(
        composer: &mut Composer,
        library: &Library,
        main: Main<'_>,
        definitions: &Definitions,
    ) -> Self {
        let mut modules = BTreeMap::new();
        let mut all: Vec<(usize, String, &str, usize)> = Vec::new();
        all.push((
            0,
            preprocessed(main.text, definitions),
            main.text,
            main.start,
        ));
        for (number, name) in &composer.module_index {
            if let Some(file) = library.module(name) {
                let text = module_text(composer, name, definitions);
                all.push((*number, text, &file.text, file.start));
            }
        }
        for (number, seen, written, start) in all {
            if let Some(header) = header(composer, written, definitions) {
                let words = Words::new(&seen, written);
                let mapped = Mapped {
                    header,
                    words,
                    start,
                };
                modules.insert(number, mapped);
            }
        }
        Self { modules }
    }

    /// A span in the texts of the source; undefined when it lies in a header, or in nothing that is known.
    pub(in crate::front) fn place(&self, span: Span) -> Span {
        let placed = || {
            let range = span.to_range()?;
            let (number, range) = split(range);
            let mapped = self.modules.get(&number)?;
            let from = range.start.checked_sub(mapped.header)?;
            let to = range.end.checked_sub(mapped.header)?;
            let at = mapped.words.written(from..to)?;
            Some(Span::from(at.start + mapped.start..at.end + mapped.start))
        };
        placed().unwrap_or_default()
    }
}

/// The number of the module that a span of naga_oil is in, and its bytes there.
pub(super) fn split(range: Range<usize>) -> (usize, Range<usize>) {
    let number = range.start >> SHIFT;
    let mask = (1 << SHIFT) - 1;
    (number, range.start & mask..range.end & mask)
}

/// A composed text as the preprocessor leaves it.
pub(super) fn preprocessed(text: &str, definitions: &Definitions) -> String {
    let preprocessor = Preprocessor::default();
    let plain = with_plain_lines(text);
    let Ok((text, _)) = preprocessor.extract_wgsl_directives(&plain) else {
        return String::new();
    };
    let done = preprocessor.preprocess(&text, definitions);
    done.map_or_else(|_| String::new(), |done| done.preprocessed_source)
}

/// A module's text as the preprocessor leaves it.
pub(super) fn module_text(composer: &Composer, name: &str, definitions: &Definitions) -> String {
    let source = ErrSource::Module {
        name: name.to_owned(),
        offset: 0,
        defs: definitions.clone(),
    };
    source.source(composer).into_owned()
}

fn with_plain_lines(text: &str) -> String {
    text.replace("\r\n", "\n").replace('\r', "\n")
}

/// How much stands before a text that composes: what naga_oil says of the same text with a flaw at its end.
fn header(composer: &mut Composer, text: &str, definitions: &Definitions) -> Option<usize> {
    let flawed = format!("{text}\n!\n");
    let made = composer.make_naga_module(NagaModuleDescriptor {
        source: &flawed,
        file_path: "",
        shader_type: ShaderType::Wgsl,
        shader_defs: definitions.clone(),
        additional_imports: &[],
    });
    match made {
        Err(error) if matches!(error.inner, ComposerErrorInner::WgslParseError(_)) => {
            Some(error.source.offset())
        }
        _ => None,
    }
}

/// How the words of two texts with the same lines stand to each other.
pub(super) struct Words {
    /// For each word of the text that naga saw, its bytes there and in the file, in order.
    pairs: Vec<(Range<usize>, Range<usize>)>,
}

impl Words {
    pub(super) fn new(seen: &str, written: &str) -> Self {
        let mut pairs = Vec::new();
        let (mut seen_at, mut written_at) = (0, 0);
        let mut lines = written.split_inclusive('\n');
        for line in seen.split_inclusive('\n') {
            let Some(own) = lines.next() else { break };
            let (a, b) = (words(line), words(own));
            let shift = |r: &Range<usize>, by: usize| r.start + by..r.end + by;
            if a.len() == b.len() {
                for (a, b) in a.iter().zip(&b) {
                    pairs.push((shift(a, seen_at), shift(b, written_at)));
                }
            } else if let (Some(first), Some(last)) = (a.first(), a.last()) {
                // Words of the line cannot be told apart: all of them are the line.
                let all = written_at + own.len() - own.trim_start().len()
                    ..written_at + own.trim_end().len();
                pairs.push((first.start + seen_at..last.end + seen_at, all));
            }
            seen_at += line.len();
            written_at += own.len();
        }
        Self { pairs }
    }

    /// A range of the text that naga saw, in the file.
    pub(super) fn written(&self, seen: Range<usize>) -> Option<Range<usize>> {
        let first = self.pairs.partition_point(|(a, _)| a.end <= seen.start);
        let behind = self.pairs.partition_point(|(a, _)| a.start < seen.end);
        let (a, start) = self.pairs.get(first)?;
        let (b, end) = self.pairs.get(behind.checked_sub(1)?.max(first))?;
        // A range that begins within a long word, as one of a component does, keeps its distance.
        let inside = |at: usize, (a, b): (&Range<usize>, &Range<usize>)| match a.len() == b.len() {
            true => at.clamp(a.start, a.end) - a.start + b.start,
            false if at <= a.start => b.start,
            false => b.end,
        };
        let from = match a.len() == start.len() {
            true => inside(seen.start.max(a.start), (a, start)),
            false => start.start,
        };
        Some(from..inside(seen.end, (b, end)).max(from))
    }
}

/// The words of a line, as bytes: runs of what names are made of (with `::` and shader defs to be put in, `#{N}`
/// or `#N`, and all between quotes), and every other character that is no blank by itself.
fn words(line: &str) -> Vec<Range<usize>> {
    let joins = |c: char| c.is_alphanumeric() || c == '_';
    let mut words = Vec::new();
    let mut at = 0;
    while let Some(first) = line[at..].chars().next() {
        let start = at;
        at += first.len_utf8();
        if first.is_whitespace() {
            continue;
        }
        if joins(first) || matches!(first, '"' | '#') {
            at = start;
            let mut quoted = false;
            while let Some(next) = line[at..].chars().next() {
                let rest = &line[at..];
                at += match next {
                    '#' if !quoted => match rest.strip_prefix("#{").and_then(|r| r.find('}')) {
                        Some(close) => close + 3,
                        None => 1,
                    },
                    _ if rest.starts_with("::") => 2,
                    '"' => {
                        quoted = !quoted;
                        1
                    }
                    other if quoted || joins(other) => other.len_utf8(),
                    _ => break,
                };
            }
        }
        words.push(start..at);
    }
    words
}

#[cfg(test)]
mod tests {
    use super::*;

    fn mapped(seen: &str, written: &str, what: &str) -> String {
        let words = Words::new(seen, written);
        let at = seen.find(what).unwrap();
        written[words.written(at..at + what.len()).unwrap()].to_owned()
    }

    #[test]
    fn words_are_found_again_behind_longer_names() {
        let written = "#import a::b\r\nlet x = b::c(1.0) + #{N}u * d;\r\n";
        let seen = "            \nlet x = cX_naga_oil_mod_XMEX(1.0) + 8u * d;\n";
        assert_eq!(mapped(seen, written, "cX_naga_oil_mod_XMEX"), "b::c");
        assert_eq!(
            mapped(seen, written, "cX_naga_oil_mod_XMEX(1.0)"),
            "b::c(1.0)"
        );
        assert_eq!(mapped(seen, written, "* d"), "* d");
        assert_eq!(mapped(seen, written, "let x"), "let x");
    }

    #[test]
    fn ranges_over_lines_and_within_words_are_kept() {
        let text = "fn f() {\n    let abc = v.xyz;\n}\n";
        assert_eq!(mapped(text, text, "f() {\n    let"), "f() {\n    let");
        assert_eq!(mapped(text, text, "yz"), "yz");
    }
}
