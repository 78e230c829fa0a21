//! PLY, as scanners write it: a header that lists elements and their properties, then the numbers, as text or binary.
//!
//! Read are positions, normals, texture coordinates and colours of vertices, the corners of faces, and texture
//! coordinates of corners. Colours are taken as sRGB. The image of a `comment TextureFile` is the base colour's.

use super::build::{Corner, Numbers, Triangle, add_polygon, build, linear};
use super::obj::short;
use super::{Material, Model};

/// The most bytes of a header, and the most properties in it.
const MOST_HEADER: usize = 64 << 10;

/// Reads a PLY file.
///
/// # Errors
/// What is wrong, with the line of the header or the element, to be put behind the model's name.
pub fn ply(bytes: &[u8]) -> Result<Model, String> {
    let (header, body) = Header::read(bytes)?;
    let vertices = header.elements.iter().find(|e| e.name == "vertex");
    let mut reading = Reading {
        vertices: vertices.map_or(0, |element| element.count),
        ..Reading::default()
    };
    let mut body = Body {
        bytes: body,
        format: header.format,
    };
    for element in &header.elements {
        reading.element(element, &mut body)?;
    }
    reading.finish(header.image)
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Format {
    Text,
    LittleEndian,
    BigEndian,
}

/// A type of numbers.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Kind {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    F32,
    F64,
}

impl Kind {
    fn of_name(name: &str) -> Option<Self> {
        Some(match name {
            "char" | "int8" => Self::I8,
            "uchar" | "uint8" => Self::U8,
            "short" | "int16" => Self::I16,
            "ushort" | "uint16" => Self::U16,
            "int" | "int32" => Self::I32,
            "uint" | "uint32" => Self::U32,
            "float" | "float32" => Self::F32,
            "double" | "float64" => Self::F64,
            _ => return None,
        })
    }

    fn size(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::I32 | Self::U32 | Self::F32 => 4,
            Self::F64 => 8,
        }
    }

    /// What a number is divided by to be of 0 to 1.
    fn most(self) -> f64 {
        match self {
            Self::I8 => 127.0,
            Self::U8 => 255.0,
            Self::I16 => 32_767.0,
            Self::U16 => 65_535.0,
            Self::I32 => 2_147_483_647.0,
            Self::U32 => 4_294_967_295.0,
            Self::F32 | Self::F64 => 1.0,
        }
    }
}

#[derive(Clone, Debug)]
struct Property {
    name: String,
    kind: Kind,
    /// The type of the count, when it is a list.
    list: Option<Kind>,
}

#[derive(Clone, Debug)]
struct Element {
    name: String,
    count: usize,
    properties: Vec<Property>,
}

impl Element {
    /// As few bytes as an entry may have.
    fn least(&self, format: Format) -> usize {
        let sizes = self.properties.iter().map(|p| match format {
            // A digit, and what parts it from the next.
            Format::Text => 2,
            _ => p.list.unwrap_or(p.kind).size(),
        });
        sizes.sum()
    }
}

struct Header {
    format: Format,
    elements: Vec<Element>,
    image: Option<String>,
}

impl Header {
    /// The header, and what is behind it.
    fn read(bytes: &[u8]) -> Result<(Self, &[u8]), String> {
        let start = &bytes[..bytes.len().min(MOST_HEADER)];
        let mut header = Self {
            format: Format::Text,
            elements: Vec::new(),
            image: None,
        };
        let mut at = 0;
        let mut has_format = false;
        for number in 1.. {
            let rest = start.get(at..).unwrap_or_default();
            let Some(end) = rest.iter().position(|byte| *byte == b'\n') else {
                return Err(match number {
                    1 => "it does not begin with `ply`".to_owned(),
                    _ => "its header has no end".to_owned(),
                });
            };
            at += end + 1;
            let line = String::from_utf8_lossy(&rest[..end]);
            let line = line.trim();
            if number == 1 {
                match line {
                    "ply" => continue,
                    _ => return Err("it does not begin with `ply`".to_owned()),
                }
            }
            if line == "end_header" {
                break;
            }
            let read = header.line(line, &mut has_format);
            read.map_err(|why| format!("line {number}: {why}"))?;
        }
        match has_format {
            true => Ok((header, &bytes[at..])),
            false => Err("its header says no format".to_owned()),
        }
    }

    fn line(&mut self, line: &str, has_format: &mut bool) -> Result<(), String> {
        let words: Vec<&str> = line.split_whitespace().collect();
        let kind = |name: &str| {
            Kind::of_name(name).ok_or_else(|| format!("there is no type `{}`", short(name)))
        };
        match words.as_slice() {
            [] | ["obj_info", ..] => {}
            ["comment", "TextureFile", ..] => {
                let file = line.splitn(3, char::is_whitespace).nth(2);
                self.image = self.image.take().or(file.map(|f| f.trim().to_owned()));
            }
            ["comment", ..] => {}
            ["format", format, _] => {
                *has_format = true;
                self.format = match *format {
                    "ascii" => Format::Text,
                    "binary_little_endian" => Format::LittleEndian,
                    "binary_big_endian" => Format::BigEndian,
                    other => return Err(format!("there is no format `{}`", short(other))),
                };
            }
            ["element", name, count] => self.elements.push(Element {
                name: (*name).to_owned(),
                count: count
                    .parse()
                    .map_err(|_| format!("`{}` is no number of elements", short(count)))?,
                properties: Vec::new(),
            }),
            ["property", rest @ ..] => {
                let property = match rest {
                    ["list", count, item, name] => Property {
                        name: (*name).to_owned(),
                        kind: kind(item)?,
                        list: Some(kind(count)?),
                    },
                    [item, name] => Property {
                        name: (*name).to_owned(),
                        kind: kind(item)?,
                        list: None,
                    },
                    _ => return Err("a property has a type and a name".to_owned()),
                };
                let element = self.elements.last_mut();
                let element = element.ok_or("a property belongs to no element")?;
                element.properties.push(property);
            }
            [keyword, ..] => return Err(format!("there is no `{}` in a header", short(keyword))),
        }
        Ok(())
    }
}

/// The numbers that are not read yet.
struct Body<'b> {
    bytes: &'b [u8],
    format: Format,
}

impl Body<'_> {
    fn number(&mut self, kind: Kind) -> Result<f64, String> {
        let ends = || "the file ends before it".to_owned();
        if self.format == Format::Text {
            let start = self.bytes.iter().position(|b| !b.is_ascii_whitespace());
            let rest = &self.bytes[start.ok_or_else(ends)?..];
            let end = rest.iter().position(u8::is_ascii_whitespace);
            let (word, rest) = rest.split_at(end.unwrap_or(rest.len()));
            self.bytes = rest;
            let word = String::from_utf8_lossy(word);
            return word
                .parse()
                .map_err(|_| format!("`{}` is no number", short(&word)));
        }
        let size = kind.size();
        let (bytes, rest) = self.bytes.split_at_checked(size).ok_or_else(ends)?;
        self.bytes = rest;
        // With the most significant byte first.
        let mut big = [0; 8];
        for (to, byte) in big[8 - size..].iter_mut().zip(bytes) {
            *to = *byte;
        }
        if self.format == Format::LittleEndian {
            big[8 - size..].reverse();
        }
        let word = u64::from_be_bytes(big);
        Ok(match kind {
            Kind::I8 => f64::from((word as u8).cast_signed()),
            Kind::I16 => f64::from((word as u16).cast_signed()),
            Kind::I32 => f64::from((word as u32).cast_signed()),
            Kind::U8 | Kind::U16 | Kind::U32 => word as f64,
            Kind::F32 => f64::from(f32::from_bits(word as u32)),
            Kind::F64 => f64::from_bits(word),
        })
    }

    /// The numbers of a list, into one that is used again.
    fn list(&mut self, count: Kind, kind: Kind, numbers: &mut Vec<f64>) -> Result<(), String> {
        numbers.clear();
        let count = self.number(count)?;
        // There are at least as many bytes as numbers.
        if !(count >= 0.0 && count <= self.bytes.len() as f64 && count.fract() == 0.0) {
            return Err(format!("a list has {count} numbers"));
        }
        for _ in 0..count as usize {
            numbers.push(self.number(kind)?);
        }
        Ok(())
    }
}

/// Where in a row the numbers are that are read.
#[derive(Default)]
struct Columns {
    position: Option<[usize; 3]>,
    normal: Option<[usize; 3]>,
    uv: Option<[usize; 2]>,
    /// Each with what 1 is written as.
    colour: Option<[(usize, f64); 3]>,
    alpha: Option<(usize, f64)>,
    /// A list of vertices.
    corners: Option<usize>,
    /// A list of two texture coordinates for each corner.
    corner_uvs: Option<usize>,
}

impl Columns {
    fn of(element: &Element) -> Self {
        let find = |names: &[&str], list: bool| {
            let mut properties = element.properties.iter();
            properties.position(|p| p.list.is_some() == list && names.contains(&p.name.as_str()))
        };
        let one = |names: &[&str]| find(names, false);
        let share = |names: &[&str]| one(names).map(|at| (at, element.properties[at].kind.most()));
        let three = |a, b, c| Some([one(&[a])?, one(&[b])?, one(&[c])?]);
        let pair = || {
            let u = one(&["s", "u", "texture_u", "tex_u"])?;
            Some([u, one(&["t", "v", "texture_v", "tex_v"])?])
        };
        let colour = || {
            let red = share(&["red", "r", "diffuse_red"])?;
            let green = share(&["green", "g", "diffuse_green"])?;
            Some([red, green, share(&["blue", "b", "diffuse_blue"])?])
        };
        Self {
            position: three("x", "y", "z"),
            normal: three("nx", "ny", "nz"),
            uv: pair(),
            colour: colour(),
            alpha: share(&["alpha", "a", "diffuse_alpha"]),
            corners: find(&["vertex_indices", "vertex_index"], true),
            corner_uvs: find(&["texcoord"], true),
        }
    }
}

/// An entry of an element: of each property its number, or its list.
struct Row {
    numbers: Vec<f64>,
    lists: Vec<Vec<f64>>,
}

#[derive(Default)]
struct Reading {
    /// How many the header says.
    vertices: usize,
    numbers: Numbers,
    triangles: Vec<Triangle>,
    corner_uvs: Vec<[f32; 2]>,
    strips: bool,
}

impl Reading {
    fn element(&mut self, element: &Element, body: &mut Body) -> Result<(), String> {
        let name = &element.name;
        let needed = element.least(body.format).checked_mul(element.count);
        // The last of a text may have nothing behind it.
        if needed.is_none_or(|needed| needed > body.bytes.len() + 1) {
            return Err(format!(
                "it is cut off: {} of `{}` do not fit into the {} bytes that are left",
                element.count,
                short(name),
                body.bytes.len()
            ));
        }
        if element.properties.is_empty() {
            return Ok(());
        }
        let read = match name.as_str() {
            "vertex" => Self::vertex,
            "face" => Self::face,
            other => {
                self.strips |= other == "tristrips" && element.count > 0;
                Self::skip
            }
        };
        let columns = Columns::of(element);
        let mut row = Row {
            numbers: vec![0.0; element.properties.len()],
            lists: vec![Vec::new(); element.properties.len()],
        };
        for i in 0..element.count {
            let mut one = || -> Result<(), String> {
                for (at, property) in element.properties.iter().enumerate() {
                    match property.list {
                        None => row.numbers[at] = body.number(property.kind)?,
                        Some(count) => body.list(count, property.kind, &mut row.lists[at])?,
                    }
                }
                read(self, &columns, &row)
            };
            one().map_err(|why| format!("{} {i}: {why}", short(name)))?;
        }
        Ok(())
    }

    fn skip(&mut self, _: &Columns, _: &Row) -> Result<(), String> {
        Ok(())
    }

    fn vertex(&mut self, columns: &Columns, row: &Row) -> Result<(), String> {
        let finite =
            |numbers: &[f64], what: &str| match numbers.iter().all(|x| (*x as f32).is_finite()) {
                true => Ok(()),
                false => Err(format!("its {what} is no finite number")),
            };
        let pick = |at: [usize; 3]| at.map(|at| row.numbers[at]);
        let position = pick(columns.position.ok_or("it has no x, y and z")?);
        finite(&position, "position")?;
        self.numbers.positions.push(position.map(|x| x as f32));
        if let Some(at) = columns.normal {
            let normal = pick(at);
            finite(&normal, "normal")?;
            self.numbers.normals.push(normal.map(|x| x as f32));
        }
        if let Some(at) = columns.uv {
            let uv = at.map(|at| row.numbers[at]);
            finite(&uv, "texture coordinate")?;
            self.numbers.uvs.push(uv.map(|x| x as f32));
        }
        if let Some(at) = columns.colour {
            let share = |(at, most): (usize, f64)| row.numbers[at] / most;
            let [r, g, b] = at.map(|at| linear(share(at)));
            let alpha = columns.alpha.map_or(1.0, |at| share(at).clamp(0.0, 1.0));
            // A NaN is no colour.
            let colour = [r, g, b, alpha as f32].map(|x| if x.is_finite() { x } else { 1.0 });
            self.numbers.colours.push(colour);
        }
        Ok(())
    }

    fn face(&mut self, columns: &Columns, row: &Row) -> Result<(), String> {
        let at = columns.corners.ok_or("it has no `vertex_indices`")?;
        let vertices = self.vertices;
        let indices = &row.lists[at];
        if let Some(index) = indices
            .iter()
            .find(|index| !((0.0..vertices as f64).contains(*index) && index.fract() == 0.0))
        {
            return Err(format!(
                "an index is {index}, and there are {vertices} vertices"
            ));
        }
        // Two numbers a corner, or the corners have none.
        let uvs = columns.corner_uvs.map(|at| &row.lists[at]);
        let uvs = uvs.filter(|uvs| uvs.len() == 2 * indices.len());
        let first = uvs.map(|uvs| {
            let first = self.corner_uvs.len() as u32;
            let finite = |x: &f64| if x.is_finite() { *x as f32 } else { 0.0 };
            let pairs = uvs.chunks_exact(2);
            let pairs = pairs.map(|uv| [finite(&uv[0]), finite(&uv[1])]);
            self.corner_uvs.extend(pairs);
            first
        });
        let corner = |(i, index): (usize, &f64)| Corner {
            position: *index as u32,
            uv: first.map(|first| first + i as u32),
            normal: None,
        };
        let corners: Vec<Corner> = indices.iter().enumerate().map(corner).collect();
        add_polygon(&mut self.triangles, 0, &corners, 0)
    }

    fn finish(mut self, image: Option<String>) -> Result<Model, String> {
        if self.triangles.is_empty() {
            return Err(match (self.strips, self.vertices) {
                (true, _) => "it has strips of triangles, and no faces".to_owned(),
                (false, 0) => "it has no vertices".to_owned(),
                (false, n) => format!("it has {n} points, and no faces"),
            });
        }
        let by_vertex = self.corner_uvs.is_empty() && !self.numbers.uvs.is_empty();
        if !by_vertex {
            self.numbers.uvs = self.corner_uvs;
        }
        let has_normals = !self.numbers.normals.is_empty();
        for corner in self.triangles.iter_mut().flat_map(|t| &mut t.corners) {
            if by_vertex {
                corner.uv = Some(corner.position);
            }
            corner.normal = has_normals.then_some(corner.position);
        }
        let (mesh, repaired) = build(&self.numbers, &[self.triangles]);
        let mut warnings = Vec::new();
        if repaired > 0 {
            warnings.push(format!(
                "has {repaired} normals without a direction, which are made anew"
            ));
        }
        let mut material = Material::named("");
        material.base_image = image;
        Ok(Model {
            mesh,
            materials: vec![material],
            warnings,
        })
    }
}
