//! Reads accessors: the numbers of positions, normals and indices, out of buffers that may hold anything.
//!
//! Every range is checked against the bytes that are there before anything is allocated. The reader of the `gltf`
//! crate expects valid files, so only its tables are used.

use gltf::accessor::{DataType, Dimensions};
use gltf::buffer::View;
use std::sync::Arc;

/// The most entries that an accessor may have: as many as a mesh may have corners.
pub(super) const MOST_ENTRIES: usize = 3 * super::MOST_TRIANGLES;

/// The bytes of a buffer, which images may be in.
pub(super) type Bytes = Arc<Vec<u8>>;

/// The bytes of every buffer, by its index.
pub(super) type Buffers = [Bytes];

/// Vectors of `N` floats; integers are converted as glTF says, normalised where the file says so.
///
/// # Errors
/// What is wrong, to be put behind the accessor's name.
pub(super) fn floats<const N: usize>(
    accessor: &gltf::Accessor,
    buffers: &Buffers,
) -> Result<Vec<[f32; N]>, String> {
    if parts(accessor.dimensions()) != N {
        return Err(format!(
            "has {} numbers an entry instead of {N}",
            parts(accessor.dimensions())
        ));
    }
    let (kind, normalised) = (accessor.data_type(), accessor.normalized());
    let number = |bytes: &[u8]| float(kind, normalised, bytes);
    let mut entries = vec![[0.0; N]; count(accessor)?];
    let size = kind.size();
    visit(accessor, N * size, buffers, |i, bytes| {
        if let Some(entry) = entries.get_mut(i) {
            for (to, bytes) in entry.iter_mut().zip(bytes.chunks_exact(size)) {
                *to = number(bytes);
            }
        }
    })?;
    Ok(entries)
}

/// Indices of vertices.
///
/// # Errors
/// As [`floats`].
pub(super) fn indices(accessor: &gltf::Accessor, buffers: &Buffers) -> Result<Vec<u32>, String> {
    let kind = accessor.data_type();
    let whole = matches!(kind, DataType::U8 | DataType::U16 | DataType::U32);
    if accessor.dimensions() != Dimensions::Scalar || !whole {
        return Err("are no whole numbers".to_owned());
    }
    let mut entries = vec![0; count(accessor)?];
    visit(accessor, kind.size(), buffers, |i, bytes| {
        if let Some(entry) = entries.get_mut(i) {
            *entry = unsigned(bytes);
        }
    })?;
    Ok(entries)
}

fn count(accessor: &gltf::Accessor) -> Result<usize, String> {
    match accessor.count() {
        n if n <= MOST_ENTRIES => Ok(n),
        n => Err(format!(
            "has {n} entries, and at most {MOST_ENTRIES} are read"
        )),
    }
}

/// Shows the bytes of every entry that the file has, with its place: those of the accessor's view first, then those
/// of its sparse part.
fn visit(
    accessor: &gltf::Accessor,
    size: usize,
    buffers: &Buffers,
    mut show: impl FnMut(usize, &[u8]),
) -> Result<(), String> {
    if let Some(view) = accessor.view() {
        let all = entries(&view, accessor.offset(), accessor.count(), size, buffers)?;
        for (i, bytes) in all.enumerate() {
            show(i, bytes);
        }
    }
    let Some(sparse) = accessor.sparse() else {
        return Ok(());
    };
    let (places, values) = (sparse.indices(), sparse.values());
    let width = places.index_type().size();
    let places = entries(
        &places.view(),
        places.offset(),
        sparse.count(),
        width,
        buffers,
    )?;
    let values = entries(
        &values.view(),
        values.offset(),
        sparse.count(),
        size,
        buffers,
    )?;
    for (place, bytes) in places.zip(values) {
        show(unsigned(place) as usize, bytes);
    }
    Ok(())
}

/// `count` pieces of `size` bytes of a view, from `offset`.
fn entries<'b>(
    view: &View,
    offset: usize,
    count: usize,
    size: usize,
    buffers: &'b Buffers,
) -> Result<impl Iterator<Item = &'b [u8]> + use<'b>, String> {
    let short = || "reaches beyond its buffer".to_owned();
    let buffer = buffers.get(view.buffer().index()).ok_or_else(short)?;
    let end = view.offset().checked_add(view.length()).ok_or_else(short)?;
    let bytes = buffer.get(view.offset()..end).ok_or_else(short)?;
    let bytes = bytes.get(offset..).ok_or_else(short)?;
    let stride = view.stride().unwrap_or(size).max(1);
    let last = count.checked_sub(1).map(|last| last.checked_mul(stride));
    let needed = match last {
        None => Some(0),
        Some(last) => last.and_then(|last| last.checked_add(size)),
    };
    if needed.is_none_or(|needed| needed > bytes.len()) {
        return Err(short());
    }
    // All of them are inside, as was just seen.
    Ok((0..count).filter_map(move |i| bytes.get(i * stride..i * stride + size)))
}

fn parts(dimensions: Dimensions) -> usize {
    dimensions.multiplicity()
}

fn float(kind: DataType, normalised: bool, bytes: &[u8]) -> f32 {
    let scale = |value: f32, most: f32| match normalised {
        true => (value / most).max(-1.0),
        false => value,
    };
    match (kind, bytes) {
        (DataType::I8, &[a]) => scale(f32::from(a.cast_signed()), 127.0),
        (DataType::U8, &[a]) => scale(f32::from(a), 255.0),
        (DataType::I16, &[a, b]) => scale(f32::from(i16::from_le_bytes([a, b])), 32767.0),
        (DataType::U16, &[a, b]) => scale(f32::from(u16::from_le_bytes([a, b])), 65535.0),
        (DataType::U32, &[a, b, c, d]) => u32::from_le_bytes([a, b, c, d]) as f32,
        (DataType::F32, &[a, b, c, d]) => f32::from_le_bytes([a, b, c, d]),
        _ => 0.0,
    }
}

/// One, two or four bytes as a number.
fn unsigned(bytes: &[u8]) -> u32 {
    let bytes = bytes.iter().rev().take(4);
    bytes.fold(0, |number, byte| number << 8 | u32::from(*byte))
}
