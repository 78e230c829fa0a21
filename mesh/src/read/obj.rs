//! Wavefront OBJ: a line for each position, texture coordinate, normal and face.
//!
//! Faces of the same `usemtl` become one draw, whatever `o` and `g` say, as primitives of one material do in
//! glTF. Smoothing groups count where normals are missing: without an `s` line everything is smooth, and what is
//! in `s off` is flat. A position may have a colour behind it, which is taken as sRGB.

use super::build::{Corner, Numbers, Triangle, add_polygon, build, linear};
use super::{Material, Model, mtl};
use std::borrow::Cow;
use std::collections::BTreeSet;

/// Reads an OBJ file. `library` gives the bytes of a file that `mtllib` names, or nothing when there is none: its
/// materials then have their names alone.
///
/// # Errors
/// What is wrong, with its line, to be put behind the model's name.
pub fn obj(
    bytes: &[u8],
    library: &mut dyn FnMut(&str) -> Option<Vec<u8>>,
) -> Result<Model, String> {
    let text = String::from_utf8_lossy(bytes);
    let mut reading = Reading::default();
    for (number, line) in lines(&text) {
        let read = reading.line(&line, library);
        read.map_err(|why| format!("line {number}: {why}"))?;
    }
    reading.finish()
}

/// Lines without comments, those that end in a backslash with the next one, and the number of the first.
pub(super) fn lines(text: &str) -> impl Iterator<Item = (usize, Cow<'_, str>)> {
    let mut lines = text.lines().map(without_comment).enumerate();
    std::iter::from_fn(move || {
        let (number, first) = lines.next()?;
        let mut line = Cow::Borrowed(first);
        while line.ends_with('\\') {
            let whole = line.to_mut();
            whole.pop();
            whole.push(' ');
            whole.push_str(lines.next().map_or("", |(_, next)| next));
        }
        Some((number + 1, line))
    })
}

/// A name may have a `#` in it: one that begins a word begins a comment.
fn without_comment(line: &str) -> &str {
    let mut signs = line.match_indices('#');
    let begins = |at: usize| !line[..at].ends_with(|before: char| !before.is_whitespace());
    let end = signs.find(|(at, _)| begins(*at));
    line[..end.map_or(line.len(), |(at, _)| at)].trim()
}

#[derive(Default)]
struct Reading {
    numbers: Numbers,
    /// The materials of the libraries.
    known: Vec<Material>,
    /// Names of materials that faces use, with their faces.
    used: Vec<(String, Vec<Triangle>)>,
    /// Which of them is in use.
    current: Option<usize>,
    triangles: usize,
    /// The smoothing group: nothing before there is one, 0 for none.
    group: Option<u32>,
    /// Faces without a group, each of which is one of its own.
    flat: u32,
    left_out: BTreeSet<String>,
    warnings: Vec<String>,
}

impl Reading {
    fn line(
        &mut self,
        line: &str,
        library: &mut dyn FnMut(&str) -> Option<Vec<u8>>,
    ) -> Result<(), String> {
        let mut words = line.split_whitespace();
        let Some(keyword) = words.next() else {
            return Ok(());
        };
        let rest = || {
            let after = line.get(keyword.len()..);
            after.unwrap_or_default().trim()
        };
        match keyword {
            "v" => self.position(words)?,
            "vt" => {
                let read = numbers(words, "a texture coordinate")?;
                let at = |i: usize| read.get(i).copied().unwrap_or(0.0);
                self.numbers.uvs.push([at(0), at(1)]);
            }
            "vn" => {
                let read = numbers(words, "a normal")?;
                let &[x, y, z, ..] = read.as_slice() else {
                    return Err("a normal needs three numbers".to_owned());
                };
                self.numbers.normals.push([x, y, z]);
            }
            "f" | "fo" => self.face(words)?,
            "s" => {
                let group = words.next().unwrap_or("off");
                self.group = Some(match group {
                    "off" => 0,
                    _ => group
                        .parse()
                        .map_err(|_| format!("`{}` is no smoothing group", short(group)))?,
                });
            }
            "usemtl" => {
                let name = rest();
                let known = self.used.iter().position(|(known, _)| known == name);
                self.current = Some(known.unwrap_or_else(|| {
                    self.used.push((name.to_owned(), Vec::new()));
                    self.used.len() - 1
                }));
            }
            "mtllib" => {
                let name = rest().replace('\\', "/");
                match library(&name) {
                    Some(bytes) => mtl::read(&name, &bytes, &mut self.known, &mut self.warnings),
                    None => self.warnings.push(format!(
                        "names the materials of `{}`, which cannot be read: they are white",
                        short(&name)
                    )),
                }
            }
            // What groups are called matters to nothing here.
            "o" | "g" | "mg" | "vp" | "lod" | "bevel" | "shadow_obj" | "trace_obj" => {}
            _ => {
                // A file of something else has no end of them.
                if self.left_out.len() < 8 {
                    self.left_out.insert(short(keyword));
                }
            }
        }
        Ok(())
    }

    fn position<'w>(&mut self, words: impl Iterator<Item = &'w str>) -> Result<(), String> {
        let read = numbers(words, "a position")?;
        let (position, colour) = match read.as_slice() {
            &[x, y, z] | &[x, y, z, _] => ([x, y, z], None),
            &[x, y, z, r, g, b] | &[x, y, z, _, r, g, b] => ([x, y, z], Some([r, g, b])),
            other => return Err(format!("a position has {} numbers", other.len())),
        };
        let numbers = &mut self.numbers;
        let white = numbers.positions.len();
        numbers.positions.push(position);
        if let Some(colour) = colour {
            numbers.colours.resize(white, [1.0; 4]);
            let [r, g, b] = colour.map(|x| linear(f64::from(x)));
            numbers.colours.push([r, g, b, 1.0]);
        }
        Ok(())
    }

    fn face<'w>(&mut self, words: impl Iterator<Item = &'w str>) -> Result<(), String> {
        let numbers = &self.numbers;
        let index = |text: &str, count: usize, what: &str| -> Result<u32, String> {
            let number: i64 = text
                .parse()
                .map_err(|_| format!("`{}` is no index of {what}", short(text)))?;
            // From the first, or back from the last that there is yet.
            let place = match number {
                1.. => number - 1,
                0 => -1,
                _ => count as i64 + number,
            };
            match u32::try_from(place) {
                Ok(place) if (place as usize) < count => Ok(place),
                _ => Err(format!(
                    "a face has {what} {number}, and there are {count} so far"
                )),
            }
        };
        let corner = |word: &str| -> Result<Corner, String> {
            let mut parts = word.split('/');
            let position = parts.next().unwrap_or_default();
            let mut other = |count: usize, what: &str| match parts.next() {
                None | Some("") => Ok(None),
                Some(text) => index(text, count, what).map(Some),
            };
            Ok(Corner {
                uv: other(numbers.uvs.len(), "texture coordinate")?,
                normal: other(numbers.normals.len(), "normal")?,
                position: index(position, numbers.positions.len(), "vertex")?,
            })
        };
        let corners = words.map(corner).collect::<Result<Vec<_>, _>>()?;
        if corners.len() < 3 {
            return Err(format!("a face has {} corners", corners.len()));
        }
        let group = match self.group {
            None => 0,
            Some(0) => {
                // Beyond those that files have.
                self.flat += 1;
                u32::MAX - self.flat
            }
            Some(group) => group,
        };
        let current = *self.current.get_or_insert_with(|| {
            self.used.push((String::new(), Vec::new()));
            self.used.len() - 1
        });
        let Some((_, triangles)) = self.used.get_mut(current) else {
            return Ok(());
        };
        let others = self.triangles - triangles.len();
        add_polygon(triangles, others, &corners, group)?;
        self.triangles = others + triangles.len();
        Ok(())
    }

    fn finish(mut self) -> Result<Model, String> {
        self.used.retain(|(_, triangles)| !triangles.is_empty());
        if self.used.is_empty() {
            return Err("it has no faces".to_owned());
        }
        if !self.numbers.colours.is_empty() {
            let count = self.numbers.positions.len();
            self.numbers.colours.resize(count, [1.0; 4]);
        }
        let (names, lists): (Vec<String>, Vec<Vec<Triangle>>) = self.used.into_iter().unzip();
        let (mesh, repaired) = build(&self.numbers, &lists);
        if repaired > 0 {
            self.warnings.push(format!(
                "has {repaired} normals without a direction, which are made anew"
            ));
        }
        if !self.left_out.is_empty() {
            let words: Vec<String> = self.left_out.iter().map(|w| format!("`{w}`")).collect();
            self.warnings
                .push(format!("has lines that are not read: {}", words.join(", ")));
        }
        let known = &self.known;
        let material = |name: &String| {
            let known = known.iter().find(|material| material.name == *name);
            known.cloned().unwrap_or_else(|| Material::named(name))
        };
        Ok(Model {
            materials: names.iter().map(material).collect(),
            mesh,
            warnings: self.warnings,
        })
    }
}

/// All words as finite numbers.
fn numbers<'w>(words: impl Iterator<Item = &'w str>, what: &str) -> Result<Vec<f32>, String> {
    let number = |word: &str| match word.parse::<f32>() {
        Ok(number) if number.is_finite() => Ok(number),
        Ok(_) => Err(format!(
            "{what} has `{}`, which is no finite number",
            short(word)
        )),
        Err(_) => Err(format!("{what} has `{}`, which is no number", short(word))),
    };
    words.map(number).collect()
}

/// A word of the file as a message shows it: not all of a long one.
pub(super) fn short(word: &str) -> String {
    match word.char_indices().nth(40) {
        Some((end, _)) => format!("{}...", &word[..end]),
        None => word.to_owned(),
    }
}
