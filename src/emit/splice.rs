//! Puts levels behind the author's text, and entry points that choose among them.
//!
//! The fragment stage always chooses; the vertex stage does where a level has another than the author's.

use super::body::{Body, Hidden, over_text};
use super::control::Control;
use super::level::fragment_function;
use super::lock::FORMAT;
use super::parameters::Block;
use super::per_pixel::PerPixel;
use super::print::{Item, Printed};
use super::source::{Signature, Text};
use super::transition::{Bands, band_end, check};
use super::varyings::Varyings;
use super::vertex::{VertexStage, has_own_vertex_stage};
use super::{EmitLevel, Output, Transition, at_zero, file_name, no_band, number};
use crate::front::Source;
use crate::front::identifiers::{Names, in_words};
use crate::{Diagnostic, Result};
use lodc_passes::Shader;
use std::collections::BTreeSet;
use std::fmt::Write;
use std::ops::Range;

/// The author's text with its levels.
pub(crate) struct Spliced {
    pub(crate) text: String,
    /// Whether a level is chosen by a pipeline constant.
    pub(crate) by_override: bool,
}

/// The author's text, with entry points replaced by ones that choose among it and the levels. `base` is its normal form.
pub(crate) fn splice(
    source: &Source,
    base: &Shader,
    levels: &[EmitLevel],
    output: Output,
    stem: &str,
) -> Result<Spliced> {
    over_text(source, |body| spliced(body, base, levels, output, stem))
}

fn spliced(
    body: &Body<'_>,
    base: &Shader,
    levels: &[EmitLevel],
    output: Output,
    stem: &str,
) -> Result<std::result::Result<Spliced, Hidden>> {
    let (source, text) = (body.source, &body.text);
    let pops = output.transition == Transition::Pop;
    let varyings = Varyings::of(base, levels.iter().map(|level| &level.shader), !pops);
    let of_vertex = has_own_vertex_stage(base, levels, &varyings);
    // Each pixel chooses: what differs in the vertex stage is no more than what the original's does too.
    let chooses = of_vertex.contains(&true) && output.per_pixel.is_none();
    let vertex = source.vertex.as_ref().filter(|_| chooses);
    let mut names = Names::default();
    names.reserve(text.words.iter().copied());
    let mut control = match output.per_pixel {
        None => Control::new(body, output.form, vertex.is_some(), &mut names)?,
        Some(_) => Control::of_pixel(),
    };
    if !pops && control.by_override {
        return Err(no_band(
            "a pipeline constant is the same for all draws of a pipeline",
        ));
    }
    let mut out = header(source, levels, stem);
    let line_break = |out: &mut String| {
        if !out.is_empty() && !out.ends_with('\n') {
            out.push_str(text.line_end);
        }
    };
    let declaration = control.declaration.as_ref();
    let declaration = declaration.map_or(String::new(), |text| format!("\n{text}"));
    if levels.is_empty() {
        check(source, output.transition)?;
        out.push_str(text.text);
        line_break(&mut out);
        out.push_str(&declaration);
        return Ok(Ok(Spliced {
            text: with_line_ends(out, text.line_end),
            by_override: control.by_override,
        }));
    }

    // A level at 0 takes the place of the original, which nothing calls then.
    let zero = at_zero(levels).0;
    let numbers = number(levels, 1)..number(levels, 1) + levels.len();
    let taken = (body.module, control.bindings);
    let block = Block::of(levels, taken, &mut names);
    let mut chosen = |name: &String| Chosen::new(body, name, numbers.clone(), &control, &mut names);
    let vertex = vertex.map(&mut chosen).transpose()?;
    let fragment = chosen(&source.fragment)?;
    let per_pixel = match output.per_pixel {
        None => None,
        Some(scale) => {
            let of = (&fragment, &varyings);
            match PerPixel::new(body, (base, levels), of, scale, &mut names)? {
                Ok(per_pixel) => Some(per_pixel),
                Err(hidden) => return Ok(Err(hidden)),
            }
        }
    };
    if let Some(per_pixel) = &per_pixel {
        control.value.clone_from(&per_pixel.value);
    }
    let bands = match Bands::new(body, &fragment, output, &mut names)? {
        Ok(bands) => bands,
        Err(hidden) => return Ok(Err(hidden)),
    };
    let stages = || vertex.iter().chain([&fragment]);
    let demoted: Vec<(&Signature, &str)> = stages()
        .map(|stage| (&stage.signature, &*stage.functions[0]))
        .collect();
    let authors = text.demoted(&demoted);
    let of_pixel = per_pixel
        .as_ref()
        .and_then(|per_pixel| per_pixel.original.as_ref());
    out.push_str(&match zero.or(of_pixel) {
        Some(_) => without(&authors, &fragment.functions[0], text.line_end),
        None => authors,
    });
    line_break(&mut out);
    out.push_str(&declaration);

    let mut behind = Behind {
        body,
        names,
        apart: block
            .iter()
            .flat_map(Block::names)
            .map(str::to_owned)
            .collect(),
        extra: Vec::new(),
    };
    let vertex = match &vertex {
        None => VertexStage::of_nobody(levels),
        Some(vertex) => {
            let stages = (vertex, &fragment);
            let made = VertexStage::new(
                stages,
                base,
                (levels, &of_vertex),
                (varyings, block.as_ref()),
                &mut behind,
            )?;
            match made {
                Ok(stage) => {
                    let head = vertex
                        .signature
                        .with(text, &vertex.arguments, &[], stage.result());
                    let mut drawn = Vec::new();
                    for (at, level) in levels.iter().enumerate() {
                        drawn.push((level.autolod, stage.bodies[at].clone()));
                        if let Some(end) = band_end(levels, at, output) {
                            drawn.push((end, stage.between[at].clone()));
                        }
                    }
                    let chosen = branches(&control, &drawn, &stage.bodies[levels.len()]);
                    write!(out, "{}\n{head} {{\n{chosen}}}\n", stage.declaration).ok();
                    stage
                }
                Err(hidden) => return Ok(Err(hidden)),
            }
        }
    };
    let fronts = match &per_pixel {
        None => None,
        Some(per_pixel) => match per_pixel.written((base, levels), block.as_ref(), &mut behind)? {
            Ok(fronts) => Some(fronts),
            Err(hidden) => return Ok(Err(hidden)),
        },
    };
    let call = |at: usize| {
        let mut further = match at {
            0 => Vec::new(),
            at => vertex.handed_to(at - 1),
        };
        let gradients = match (&per_pixel, &fronts) {
            (Some(per_pixel), Some((_, members))) => per_pixel.arguments(at, members),
            _ => Vec::new(),
        };
        further.extend(gradients.iter().map(String::as_str));
        fragment.call(&fragment.functions[at], &further)
    };
    let bodies: Vec<String> = (0..=levels.len())
        .map(|at| {
            let call = call(at);
            match (fragment.signature.result.is_some(), at == levels.len()) {
                (true, _) => format!("return {call};"),
                (false, true) => format!("{call};"),
                (false, false) => format!("{call}; return;"),
            }
        })
        .collect();
    let mut drawn = Vec::new();
    for (at, level) in levels.iter().enumerate() {
        drawn.push((level.autolod, bodies[at].clone()));
        if let Some((bands, end)) = bands.as_ref().zip(band_end(levels, at, output)) {
            let calls = [at, at + 1].map(&call);
            let before = at
                .checked_sub(1)
                .map_or(base, |before| &levels[before].shader);
            let body = bands.body(
                (at, &fragment),
                [&calls[0], &calls[1]],
                (&control.value, level.autolod, end),
                [before, &level.shader],
                body.module,
            );
            drawn.push((end, body));
        }
    }
    let further = vertex.further.iter().map(|one| &*one.declaration);
    let position = bands.as_ref().and_then(|bands| bands.parameter.as_deref());
    let further: Vec<&str> = further.chain(position).collect();
    let head = (fragment.signature).with(text, &fragment.arguments, &further, None);
    let chosen = branches(&control, &drawn, &bodies[levels.len()]);
    let before = per_pixel.as_ref().map_or("", |per_pixel| &per_pixel.before);
    let before: String = before.lines().map(|line| format!("    {line}\n")).collect();
    write!(out, "\n{head} {{\n{before}{chosen}}}\n").ok();
    if let Some((text, _)) = &fronts {
        out.push_str(text);
    }

    let attribute = text
        .derivative_attribute()
        .map_or(String::new(), |a| format!("{a}\n"));
    // Behind a branch by pixels nothing looks at its neighbours.
    let written = per_pixel
        .as_ref()
        .map_or(levels, |per_pixel| &per_pixel.levels);
    if let Some(original) = of_pixel.filter(|_| zero.is_none()) {
        let name = &fragment.functions[0];
        let printed = fragment_function(body, (0, original), name, None, &behind.names)?;
        match behind.take(&printed, name) {
            Ok(function) => write!(
                out,
                "\n// Level 0. {}\n{function}",
                sentence(&original.says)
            )
            .ok(),
            Err(hidden) => return Ok(Err(hidden)),
        };
    }
    for (at, level) in written.iter().enumerate() {
        let name = &fragment.functions[at + 1];
        let printed = fragment_function(body, (at, level), name, block.as_ref(), &behind.names)?;
        let function = match behind.take(&printed, name) {
            Ok(function) => function,
            Err(hidden) => return Ok(Err(hidden)),
        };
        let says = sentence(&level.says);
        let number = number(levels, at + 1);
        write!(out, "\n// Level {number}. {says}\n").ok();
        if let Some(vertex) = &vertex.functions[at] {
            writeln!(out, "{vertex}").ok();
        }
        write!(out, "{attribute}{function}").ok();
    }
    if let Some(bands) = &bands {
        out.push_str(&bands.declarations());
        match whole(bands, base, levels, block.as_ref(), &mut behind)? {
            Ok(text) => out.push_str(&text),
            Err(hidden) => return Ok(Err(hidden)),
        }
    }
    if let Some(block) = &block {
        match block.written(levels, &mut behind)? {
            Ok(text) => out.push_str(&text),
            Err(hidden) => return Ok(Err(hidden)),
        }
    }
    for item in &behind.extra {
        write!(out, "\n{}", item.text).ok();
    }
    Ok(Ok(Spliced {
        text: with_line_ends(out, text.line_end),
        by_override: control.by_override,
    }))
}

/// A stage whose entry point chooses.
pub(crate) struct Chosen {
    /// The entry point's name.
    pub(crate) entry: String,
    pub(crate) signature: Signature,
    /// What the author's function is called now, and those of the levels.
    pub(crate) functions: Vec<String>,
    /// The entry point's parameters.
    pub(crate) arguments: Vec<String>,
}

impl Chosen {
    fn new(
        body: &Body<'_>,
        entry: &str,
        levels: Range<usize>,
        control: &Control,
        names: &mut Names,
    ) -> Result<Self> {
        let Some(signature) = body.text.signature(entry) else {
            return Err(Diagnostic::error(format!(
                "`{entry}` is no function of {}",
                body.source.name
            )));
        };
        let original = names.take(&format!("original_{entry}"));
        let of_levels = levels.map(|level| format!("lod_{}_{entry}", in_words(level)));
        let of_levels: Vec<String> = of_levels.map(|wish| names.take(&wish)).collect();
        let arguments = signature.names(&body.text).into_iter();
        let arguments = arguments.map(|name| match name == control.root {
            true => names.take(name),
            false => name.to_owned(),
        });
        Ok(Self {
            entry: entry.to_owned(),
            arguments: arguments.collect(),
            signature,
            functions: std::iter::once(original).chain(of_levels).collect(),
        })
    }

    /// A call with the entry point's parameters, and with others behind them.
    pub(crate) fn call(&self, function: &str, further: &[&str]) -> String {
        let own = self.arguments.iter().map(String::as_str);
        let all: Vec<&str> = own.chain(further.iter().copied()).collect();
        format!("{function}({})", all.join(", "))
    }
}

/// What comes behind the entry points.
pub(crate) struct Behind<'b, 'a> {
    pub(crate) body: &'b Body<'a>,
    pub(crate) names: Names,
    /// What is declared elsewhere.
    apart: BTreeSet<String>,
    /// What the levels' functions need beside what the text declares.
    extra: Vec<Item>,
}

impl Behind<'_, '_> {
    /// The text of a printed function, with what it needs put behind all.
    pub(crate) fn take(
        &mut self,
        printed: &Printed,
        function: &str,
    ) -> std::result::Result<String, Hidden> {
        let mut text = String::new();
        let mut wanted = vec![function.to_owned()];
        let mut done = BTreeSet::new();
        let mut needed = Vec::new();
        while let Some(name) = wanted.pop() {
            let Some(item) = printed.items.iter().find(|item| item.name == name) else {
                continue;
            };
            let is_there = self.body.declared.contains(&*name) || self.apart.contains(&name);
            if is_there || !done.insert(name.clone()) {
                continue;
            }
            if let Some(hidden) = self.body.hidden_from(item) {
                return Err(hidden);
            }
            wanted.extend(item.uses.iter().cloned());
            wanted.extend(
                item.predeclared
                    .iter()
                    .filter(|word| word.starts_with("_naga"))
                    .cloned(),
            );
            if name == *function {
                text.clone_from(&item.text);
            } else if !self.extra.iter().any(|have| have.text == item.text) {
                needed.push(item.clone());
            }
        }
        self.names
            .reserve(needed.iter().map(|item| item.name.as_str()));
        needed.sort_by(|a, b| a.name.cmp(&b.name));
        self.extra.extend(needed);
        Ok(text)
    }

    /// Takes a declaration away again, to be written elsewhere.
    pub(crate) fn take_out(&mut self, name: &str) -> Option<Item> {
        let at = self.extra.iter().position(|item| item.name == name)?;
        Some(self.extra.remove(at))
    }
}

/// A text without one of its functions.
fn without(text: &str, function: &str, line_end: &str) -> String {
    let read = Text::new(text);
    let Some(declaration) = read.declaration(function) else {
        return text.to_owned();
    };
    let [before, after] = [
        text[..declaration.span.start].trim_end(),
        text[declaration.span.end..].trim_start(),
    ];
    match before.is_empty() || after.is_empty() {
        true => format!("{before}{after}"),
        false => format!("{before}{line_end}{line_end}{after}"),
    }
}

/// The functions that draw the original and levels to the end, and note where a pixel would have been discarded.
fn whole(
    bands: &Bands,
    base: &Shader,
    levels: &[EmitLevel],
    block: Option<&Block>,
    behind: &mut Behind<'_, '_>,
) -> Result<std::result::Result<String, Hidden>> {
    let mut out = String::new();
    let Some((names, gone)) = bands.whole() else {
        return Ok(Ok(out));
    };
    let original = EmitLevel::original(base.clone());
    let attribute =
        (behind.body.text.derivative_attribute()).map_or(String::new(), |a| format!("{a}\n"));
    for (at, name) in names.iter().enumerate() {
        let number = match at.checked_sub(1) {
            None if at_zero(levels).0.is_some() => continue,
            None => 0,
            Some(_) => number(levels, at),
        };
        // The original has no place in the block, and reads none.
        let (level, block) = match at.checked_sub(1) {
            None => ((0, &original), None),
            Some(level) => ((level, &levels[level]), block),
        };
        let printed = fragment_function(behind.body, level, name, block, &behind.names)?;
        let function = match behind.take(&printed, name) {
            Ok(function) => function,
            Err(hidden) => return Ok(Err(hidden)),
        };
        let function = function.replace("discard;", &format!("{gone} = true;"));
        write!(
            out,
            "\n// Level {number}, drawn to the end where it discards.\n{attribute}{function}"
        )
        .ok();
    }
    Ok(Ok(out))
}

/// The body of an entry point: what is done below each value of autoLOD, and what beyond the last.
fn branches(control: &Control, drawn: &[(f32, String)], last: &str) -> String {
    let mut out = String::new();
    let mut before = 0.0;
    for (at, (until, body)) in drawn.iter().enumerate() {
        let next = drawn.get(at + 1).map_or(last, |(_, next)| next);
        // A level at 0 takes the place of the original; a band may end where the next level begins.
        if body == next || *until <= before {
            continue;
        }
        before = *until;
        let test = format!("    if !({} >= {until:?}) {{", control.value);
        match body.contains('\n') {
            true => writeln!(out, "{test}\n{}\n    }}", indented(body, "        ")),
            false => writeln!(out, "{test} {body} }}"),
        }
        .ok();
    }
    writeln!(out, "{}", indented(last, "    ")).ok();
    out
}

fn indented(text: &str, by: &str) -> String {
    let lines: Vec<String> = text.lines().map(|line| format!("{by}{line}")).collect();
    lines.join("\n")
}

/// The comment at the top: a function of the levels and the file's name alone.
fn header(source: &Source, levels: &[EmitLevel], stem: &str) -> String {
    let timed = levels.iter().any(|level| level.time.is_some());
    let column = |time: Option<f64>| match (timed, time) {
        (false, _) => String::new(),
        (true, Some(time)) => format!("{time:.2}  "),
        (true, None) => "-     ".to_owned(),
    };
    let mut out = format!(
        "// Levels of detail of {}, by lodc (lock format {FORMAT}). Made from {}.lod.toml: change that, not this.\n\
         // level  autoLOD  error  cost  {}what changed\n",
        file_name(source),
        stem,
        if timed { "time  " } else { "" },
    );
    let (zero, above) = at_zero(levels);
    let original = (1.0, Some(1.0), "the original");
    let (cost, time, says) = zero.map_or(original, |l| (l.cost, l.time, &*l.says));
    let (time, says) = (column(time), one_line(says));
    writeln!(out, "// 0      0.00     -      {cost:.2}  {time}{says}").ok();
    for (at, level) in above.iter().enumerate() {
        writeln!(
            out,
            "// {:<5}  {:<7.2}  {:.3}  {:.2}  {}{}",
            at + 1,
            level.autolod,
            level.error,
            level.cost,
            column(level.time),
            one_line(&level.says)
        )
        .ok();
    }
    out.push('\n');
    out
}

/// A text without line breaks, which would end the comment that it stands in.
fn one_line(text: &str) -> String {
    text.split_whitespace().collect::<Vec<_>>().join(" ")
}

/// With a capital letter in front and a full stop behind.
pub(crate) fn sentence(says: &str) -> String {
    let says = one_line(says);
    let mut letters = says.chars();
    match letters.next() {
        // A name keeps its letters.
        Some(first)
            if says
                .split(' ')
                .next()
                .is_some_and(|word| !word.contains(['_', '.'])) =>
        {
            format!("{}{}.", first.to_uppercase(), letters.as_str())
        }
        Some(_) => format!("{says}."),
        None => String::new(),
    }
}

/// Generated line ends made those of the author's text. Text of the author's has its own already.
pub(crate) fn with_line_ends(text: String, line_end: &str) -> String {
    if line_end == "\n" {
        return text;
    }
    let mut out = String::with_capacity(text.len() + text.len() / 32);
    let mut before = ' ';
    for c in text.chars() {
        if c == '\n' && before != '\r' {
            out.push('\r');
        }
        out.push(c);
        before = c;
    }
    out
}
