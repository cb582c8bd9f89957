//! Accessors: typed, strided, possibly sparse views of buffers.

use super::buffers::{Buffers, range};
use super::container::Document;
use super::mesh::Budget;
use crate::error::Result;
use gltf::json::accessor::{Accessor, ComponentType, Type, sparse::Sparse};

/// What an accessor may look like where it is used.
pub(super) struct Shape {
    types: &'static [Type],
    components: &'static [ComponentType],
    /// More components that KHR_mesh_quantization allows.
    quantized: &'static [ComponentType],
}

use ComponentType::{F32, I8, I16, U8, U16, U32};

const VEC3: &[Type] = &[Type::Vec3];
const VEC4: &[Type] = &[Type::Vec4];

/// Positions.
pub(super) const POSITION: Shape = Shape { types: VEC3, components: &[F32], quantized: &[I8, U8, I16, U16] };
/// Normals.
pub(super) const NORMAL: Shape = Shape { types: VEC3, components: &[F32], quantized: &[I8, I16] };
/// Tangents.
pub(super) const TANGENT: Shape = Shape { types: VEC4, components: &[F32], quantized: &[I8, I16] };
/// Texture coordinates; integers are normalised, unless KHR_mesh_quantization says otherwise.
pub(super) const TEXCOORD: Shape =
    Shape { types: &[Type::Vec2], components: &[F32, U8, U16], quantized: &[I8, U8, I16, U16] };
/// Colours; integers are normalised.
pub(super) const COLOR: Shape = Shape { types: &[Type::Vec3, Type::Vec4], components: &[F32, U8, U16], quantized: &[] };
/// Translations and scales of instances.
pub(super) const FLOAT_VEC3: Shape = Shape { types: VEC3, components: &[F32], quantized: &[] };
/// Rotations of instances; integers are normalised.
pub(super) const QUATERNION: Shape = Shape { types: VEC4, components: &[F32, I8, I16], quantized: &[] };
/// Joints of a skin that move a vertex.
pub(super) const JOINTS: Shape = Shape { types: &[Type::Vec4], components: &[U8, U16], quantized: &[] };
/// How much each of them does; integers are normalised.
pub(super) const WEIGHTS: Shape = Shape { types: &[Type::Vec4], components: &[F32, U8, U16], quantized: &[] };
/// Inverse bind matrices.
pub(super) const MATRIX: Shape = Shape { types: &[Type::Mat4], components: &[F32], quantized: &[] };
/// Times of keyframes.
pub(super) const TIME: Shape = Shape { types: &[Type::Scalar], components: &[F32], quantized: &[] };
/// Keyframes of rotations; integers are normalised.
pub(super) const ROTATION: Shape = Shape { types: &[Type::Vec4], components: &[F32, I8, U8, I16, U16], quantized: &[] };
/// Keyframes of the weights of morph targets; integers are normalised.
pub(super) const SCALAR: Shape = Shape { types: &[Type::Scalar], components: &[F32, I8, U8, I16, U16], quantized: &[] };
/// Vertex indices.
pub(super) const INDEX: Shape = Shape { types: &[Type::Scalar], components: &[U8, U16, U32], quantized: &[] };

/// The checked elements of one accessor.
pub(super) struct Elements<'a> {
    /// Number of elements.
    pub count: usize,
    component: ComponentType,
    /// Whether integers stand for [0, 1] or [-1, 1].
    normalized: bool,
    /// Bytes of one element.
    size: usize,
    stride: usize,
    /// From the first element on; none means zeros.
    base: Option<&'a [u8]>,
    /// Ascending indices of replaced elements, and their tightly packed values.
    sparse: Option<(Vec<u32>, &'a [u8])>,
}

impl<'a> Elements<'a> {
    /// Opens accessor `index`, which must have one of the forms that `shape` allows. `place` is where it is referred to.
    pub fn open(
        document: &Document,
        buffers: &'a Buffers,
        budget: &mut Budget,
        index: usize,
        shape: &Shape,
        place: &str,
    ) -> Result<Self> {
        let accessor = document.at(&document.root.accessors, index, "accessors", place)?;
        let place = format!("{place} = accessors[{index}]");
        let kind = document.valid(&accessor.type_, &place)?;
        let component = document.valid(&accessor.component_type, &place)?.0;
        shape.check(document, kind, component, &place)?;
        let size = component.size() * kind.multiplicity();
        // Elements are counted with u32 indices; u32::MAX itself stays free.
        let count = u32::try_from(accessor.count.0).ok().filter(|&count| count < u32::MAX);
        let count =
            count.ok_or_else(|| document.bad(&place, format!("count {} is absurd", accessor.count.0)))? as usize;
        let (base, stride) = open_base(document, buffers, accessor, count, size, &place)?;
        let sparse = match &accessor.sparse {
            Some(sparse) => Some(open_sparse(document, buffers, budget, sparse, count, size, &place)?),
            None => None,
        };
        Ok(Elements { count, component, normalized: is_normalized(document, accessor), size, stride, base, sparse })
    }

    /// Elements that are not an accessor's own but were decoded to `values`, tightly packed. Of the accessor only
    /// `normalized` counts.
    pub fn packed(
        document: &Document,
        accessor: &Accessor,
        (kind, component): (Type, ComponentType),
        values: &'a [u8],
        shape: &Shape,
        place: &str,
    ) -> Result<Self> {
        shape.check(document, kind, component, place)?;
        let size = component.size() * kind.multiplicity();
        let normalized = is_normalized(document, accessor);
        Ok(Elements {
            count: values.len() / size,
            component,
            normalized,
            size,
            stride: size,
            base: Some(values),
            sparse: None,
        })
    }

    /// The bytes of element `i`; none for an element that was never given a value.
    fn bytes(&self, i: usize) -> Option<&[u8]> {
        if let Some((indices, values)) = &self.sparse
            && let Ok(found) = indices.binary_search(&(i as u32))
        {
            return values.get(found * self.size..)?.get(..self.size);
        }
        self.base?.get(i * self.stride..)?.get(..self.size)
    }

    /// Element `i` as floats, integers normalised (specification, section 3.6.2.2); components it lacks are `fill`.
    pub fn vector<const N: usize>(&self, i: usize, fill: f32) -> [f32; N] {
        let Some(bytes) = self.bytes(i) else {
            return std::array::from_fn(|c| if c * self.component.size() < self.size { 0.0 } else { fill });
        };
        let scaled = |value: f32, largest: f32| if self.normalized { (value / largest).max(-1.0) } else { value };
        std::array::from_fn(|c| match (self.component, bytes.get(c * self.component.size()..).unwrap_or_default()) {
            (I8, [a, ..]) => scaled(f32::from(*a as i8), 127.0),
            (U8, [a, ..]) => scaled(f32::from(*a), 255.0),
            (I16, [a, b, ..]) => scaled(f32::from(i16::from_le_bytes([*a, *b])), 32_767.0),
            (U16, [a, b, ..]) => scaled(f32::from(u16::from_le_bytes([*a, *b])), 65_535.0),
            (F32, [a, b, c, d, ..]) => f32::from_le_bytes([*a, *b, *c, *d]),
            _ => fill,
        })
    }

    /// Element `i` as four small integers.
    pub fn joints(&self, i: usize) -> [u16; 4] {
        let bytes = self.bytes(i).unwrap_or_default();
        std::array::from_fn(|c| match (self.component, bytes.get(c * self.component.size()..).unwrap_or_default()) {
            (U8, [a, ..]) => u16::from(*a),
            (U16, [a, b, ..]) => u16::from_le_bytes([*a, *b]),
            _ => 0,
        })
    }

    /// Element `i` as an index.
    pub fn index(&self, i: usize) -> u32 {
        match self.bytes(i) {
            Some([a]) => u32::from(*a),
            Some([a, b]) => u32::from(u16::from_le_bytes([*a, *b])),
            Some([a, b, c, d]) => u32::from_le_bytes([*a, *b, *c, *d]),
            _ => 0,
        }
    }
}

impl Shape {
    /// Refuses elements of another form.
    fn check(&self, document: &Document, kind: Type, component: ComponentType, place: &str) -> Result<()> {
        let quantized = if document.uses(QUANTIZATION) { self.quantized } else { &[] };
        if self.types.contains(&kind) && (self.components.contains(&component) || quantized.contains(&component)) {
            return Ok(());
        }
        let what = format!("elements are {kind:?} of {component:?}, not {:?} of {:?}", self.types, self.components);
        Err(document.bad(place, what))
    }
}

/// The extension that allows attributes to be integers.
const QUANTIZATION: &str = "KHR_mesh_quantization";

/// Without KHR_mesh_quantization all integer attributes are normalised, whatever an accessor says.
fn is_normalized(document: &Document, accessor: &Accessor) -> bool {
    accessor.normalized || !document.uses(QUANTIZATION)
}

/// The bytes from the first element on, and the stride, with every element inside its buffer view.
fn open_base<'a>(
    document: &Document,
    buffers: &'a Buffers,
    accessor: &Accessor,
    count: usize,
    size: usize,
    place: &str,
) -> Result<(Option<&'a [u8]>, usize)> {
    let Some(view) = accessor.buffer_view else { return Ok((None, size)) };
    let (bytes, stride) = buffers.view(document, view.value(), place)?;
    let stride = stride.unwrap_or(size);
    if stride < size {
        return Err(document.bad(place, format!("stride {stride} is less than the {size} bytes of an element")));
    }
    let offset = accessor.byte_offset.unwrap_or_default().0;
    let length = match count {
        0 => Some(0),
        _ => (count as u64 - 1).checked_mul(stride as u64).and_then(|bytes| bytes.checked_add(size as u64)),
    };
    let bytes_of_elements = length.and_then(|length| range(bytes, offset, length)).ok_or_else(|| {
        let available = bytes.len();
        let what = format!(
            "{count} elements of {size} bytes, stride {stride}, from byte {offset} do not fit into the {available} \
             bytes of bufferViews[{}]",
            view.value()
        );
        document.bad(place, what)
    })?;
    Ok((Some(bytes_of_elements), stride))
}

/// Indices and values of a sparse accessor.
fn open_sparse<'a>(
    document: &Document,
    buffers: &'a Buffers,
    budget: &mut Budget,
    sparse: &Sparse,
    count: usize,
    size: usize,
    place: &str,
) -> Result<(Vec<u32>, &'a [u8])> {
    let place = format!("{place}.sparse");
    let replaced = sparse.count.0;
    if replaced > count as u64 {
        return Err(document.bad(place, format!("it replaces {replaced} of {count} elements")));
    }
    budget.charge(document, replaced * 4)?;
    let component = document.valid(&sparse.indices.component_type, &place)?.0;
    let view_of = |view: usize, offset: u64, size: usize, name: &str| {
        let (bytes, _) = buffers.view(document, view, &place)?;
        range(bytes, offset, replaced * size as u64)
            .ok_or_else(|| document.bad(&place, format!("its {name} lie outside bufferViews[{view}]")))
    };
    let indices = &sparse.indices;
    let bytes = view_of(indices.buffer_view.value(), indices.byte_offset.0, component.size(), "indices")?;
    let values = view_of(sparse.values.buffer_view.value(), sparse.values.byte_offset.0, size, "values")?;
    let tight = component.size();
    let elements =
        Elements { count, component, normalized: false, size: tight, stride: tight, base: Some(bytes), sparse: None };
    let indices: Vec<u32> = (0..replaced as usize).map(|i| elements.index(i)).collect();
    let ascending = indices.windows(2).all(|pair| pair[0] < pair[1]);
    if !ascending || indices.last().is_some_and(|&last| last as usize >= count) {
        return Err(document.bad(place, format!("its indices do not ascend or are not below {count}")));
    }
    Ok((indices, values))
}
