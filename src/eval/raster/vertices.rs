//! Runs the vertex program over a mesh.

use super::{Attribute, Frame};
use crate::eval::lane::{LANES, Mask, Words};
use crate::eval::machine::{Machine, Profile, Watcher};
use crate::eval::program::{Program, Slot};
use crate::scene::mesh::Mesh;
use naga::{Binding, BuiltIn, ScalarKind};

/// What the vertex program made of every vertex.
pub(super) struct Vertices {
    /// Clip positions.
    pub(super) positions: Vec<[f32; 4]>,
    /// For each slot of the program's outputs, a word for every vertex.
    pub(super) outputs: Vec<Vec<u32>>,
    /// What was executed.
    pub(super) profile: Profile,
}

/// Runs the program over all vertices of the frame's mesh, in order.
pub(super) fn run(program: &Program, frame: &Frame) -> Vertices {
    let draws = frame.mesh.draws().into_iter();
    let all: Vec<Vec<usize>> = draws.map(|draw| draw.vertices.collect()).collect();
    run_some(program, frame, &all)
}

/// The same with somebody who is shown each operation.
pub(super) fn run_watched(
    program: &Program,
    frame: &Frame,
    watcher: Option<&mut dyn Watcher<f32>>,
) -> Vertices {
    let draws = frame.mesh.draws().into_iter();
    let all: Vec<Vec<usize>> = draws.map(|draw| draw.vertices.collect()).collect();
    run_chosen(program, frame, &all, watcher)
}

/// Runs the program over some vertices of each draw of the frame's mesh; what is made of them comes in the same order, draw
/// by draw.
pub(super) fn run_some(program: &Program, frame: &Frame, chosen: &[Vec<usize>]) -> Vertices {
    run_chosen(program, frame, chosen, None)
}

fn run_chosen(
    program: &Program,
    frame: &Frame,
    chosen: &[Vec<usize>],
    mut watcher: Option<&mut dyn Watcher<f32>>,
) -> Vertices {
    let mesh = &*frame.mesh;
    let count = chosen.iter().map(Vec::len).sum();
    let mut outputs = vec![Vec::with_capacity(count); program.outputs().len()];
    let mut profile: Option<Profile> = None;
    let mut inputs = vec![[0; LANES]; program.inputs().len()];
    let mut block = vec![[0; LANES]; program.outputs().len()];
    for (index, (draw, chosen)) in mesh.draws().into_iter().zip(chosen).enumerate() {
        let watcher = watcher
            .as_mut()
            .map(|watcher| &mut **watcher as &mut dyn Watcher<f32>);
        let mut machine = Machine::watched(program, &frame.bindings, index, watcher);
        for vertices in chosen.chunks(LANES) {
            for (words, slot) in inputs.iter_mut().zip(program.inputs()) {
                feed(words, slot, (vertices, draw.vertices.start), frame);
            }
            let active = first_lanes(vertices.len());
            machine.run(&inputs, active, active, &mut block);
            for (all, words) in outputs.iter_mut().zip(&block) {
                all.extend_from_slice(&words[..vertices.len()]);
            }
        }
        match &mut profile {
            None => profile = Some(machine.profile()),
            Some(profile) => profile.absorb(&machine.profile()),
        }
    }
    let mut positions = vec![[f32::NAN; 4]; count];
    for (slot, words) in program.outputs().iter().zip(&outputs) {
        if matches!(slot.binding, Binding::BuiltIn(BuiltIn::Position { .. })) {
            for (position, &word) in positions.iter_mut().zip(words) {
                position[slot.component] = f32::from_bits(word);
            }
        }
    }
    Vertices {
        positions,
        outputs,
        profile: profile.unwrap_or_default(),
    }
}

/// What a vertex program executes over the mesh of a frame, with what its probes see.
pub(crate) fn profile(program: &Program, frame: &Frame) -> Profile {
    run(program, frame).profile
}

/// Whether two vertex programs hand over the same for every vertex of a frame's mesh; a zero has no sign.
pub(crate) fn hand_over_the_same(programs: [&Program; 2], frame: &Frame) -> bool {
    let [one, other] = programs.map(|program| run(program, frame).outputs);
    let slots = programs.map(Program::outputs);
    let place = |slot: &Slot| (slot.binding.clone(), slot.component, slot.kind);
    let same = |kind: ScalarKind, (one, other): (&u32, &u32)| {
        let zeros = [one, other].map(|word| f32::from_bits(*word) == 0.0);
        one == other || (kind == ScalarKind::Float && zeros == [true, true])
    };
    slots[0].iter().map(place).eq(slots[1].iter().map(place))
        && slots[0]
            .iter()
            .zip(one.iter().zip(&other))
            .all(|(slot, (one, other))| one.iter().zip(other).all(|words| same(slot.kind, words)))
}

/// Fills one input for some vertices, of a draw that begins at `start`.
fn feed(words: &mut Words, slot: &Slot, (vertices, start): (&[usize], usize), frame: &Frame) {
    let location = match slot.binding {
        Binding::BuiltIn(BuiltIn::VertexIndex) => {
            for (word, vertex) in words.iter_mut().zip(vertices) {
                *word = (vertex - start) as u32;
            }
            return;
        }
        // One instance, and every base is 0.
        Binding::BuiltIn(_) => return words[..vertices.len()].fill(0),
        Binding::Location { location, .. } => location,
    };
    for (word, vertex) in words.iter_mut().zip(vertices) {
        let fed = (location, slot.component);
        *word = self::attribute(frame, fed, slot.kind, *vertex);
    }
}

/// The word that feeds a component of the input at a location, for a vertex of the frame's mesh.
pub(crate) fn attribute(
    frame: &Frame,
    (location, place): (u32, usize),
    kind: ScalarKind,
    vertex: usize,
) -> u32 {
    let attribute = frame.attributes.get(&location);
    if let Some(Attribute::Fixed(fixed)) = attribute {
        return fixed.get(place).copied().unwrap_or(0);
    }
    let value = attribute
        .and_then(|&attribute| component(&frame.mesh, attribute, vertex, place))
        .unwrap_or(if place == 3 { 1.0 } else { 0.0 });
    match kind {
        ScalarKind::Uint => value as u32,
        ScalarKind::Sint => (value as i32).cast_unsigned(),
        ScalarKind::Bool => u32::from(value != 0.0),
        ScalarKind::Float | ScalarKind::AbstractInt | ScalarKind::AbstractFloat => value.to_bits(),
    }
}

/// A component of a vertex's attribute, if the mesh has it.
fn component(mesh: &Mesh, attribute: Attribute, vertex: usize, component: usize) -> Option<f32> {
    let three = |all: &[[f32; 3]]| all.get(vertex)?.get(component).copied();
    match attribute {
        Attribute::Position => three(&mesh.positions),
        Attribute::Normal => three(&mesh.normals),
        Attribute::SecondUv if !mesh.second_uvs.is_empty() => {
            mesh.second_uvs.get(vertex)?.get(component).copied()
        }
        Attribute::Uv | Attribute::SecondUv => mesh.uvs.get(vertex)?.get(component).copied(),
        Attribute::Tangent => mesh.tangents.get(vertex)?.get(component).copied(),
        Attribute::Bitangent => {
            let (n, t) = (mesh.normals.get(vertex)?, mesh.tangents.get(vertex)?);
            let (a, b) = ((component + 1) % 3, (component + 2) % 3);
            (component < 3).then(|| (n[a] * t[b] - n[b] * t[a]) * t[3])
        }
        // Its words are not the mesh's.
        Attribute::Fixed(_) => None,
        Attribute::BitangentSign if component == 0 => mesh.tangents.get(vertex).map(|t| t[3]),
        Attribute::BitangentSign => None,
        Attribute::Colour => mesh.colours.get(vertex)?.get(component).copied(),
    }
}

/// The mask of the first `count` lanes.
fn first_lanes(count: usize) -> Mask {
    let mut mask = Mask::default();
    for (i, word) in mask.0.iter_mut().enumerate() {
        *word = match count.saturating_sub(i * 64) {
            0 => 0,
            n if n < 64 => (1 << n) - 1,
            _ => u64::MAX,
        };
    }
    mask
}
