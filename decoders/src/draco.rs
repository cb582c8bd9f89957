//! Draco triangle meshes, as `KHR_draco_mesh_compression` embeds them.

use crate::{Result, broken};
use draco_core::draco_types::DataType;
use draco_core::{DecodeLimits, DecoderBuffer, MeshDecoder, PointIndex};

/// A decoded triangle mesh.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Mesh {
    /// Number of vertices; every attribute has as many elements.
    pub vertices: u32,
    /// Three a triangle, each below `vertices`.
    pub indices: Vec<u32>,
    /// In the file's order.
    pub attributes: Vec<Attribute>,
}

/// One attribute of a [`Mesh`], tightly packed.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Attribute {
    /// What the glTF file calls it by.
    pub id: u32,
    /// glTF's component type: 5120 to 5126.
    pub component_type: u32,
    /// Components of an element, 1 to 4.
    pub components: u32,
    /// Little-endian elements, one a vertex.
    pub values: Vec<u8>,
}

/// Decodes a mesh of at most `max_bytes` of indices and attributes.
///
/// # Errors
/// [`Fault::Broken`](crate::Fault::Broken) for a broken stream, or one that is larger.
pub fn decode(bytes: &[u8], max_bytes: u64) -> Result<Mesh> {
    let limits = DecodeLimits::default().with_max_faces(max_bytes / 12).with_max_decoded_bytes(max_bytes);
    let mut mesh = draco_core::Mesh::new();
    let mut buffer = DecoderBuffer::new(bytes).with_limits(limits);
    let decoded = MeshDecoder::new().decode(&mut buffer, &mut mesh);
    decoded.map_err(|error| broken(format!("Draco: {error}")))?;

    let vertices = u32::try_from(mesh.num_points()).map_err(|_| broken("Draco: too many vertices"))?;
    let indices: Vec<u32> = mesh.faces().iter().flatten().map(|point| point.0).collect();
    if indices.iter().any(|&index| index >= vertices) {
        return Err(broken("Draco: an index is out of range"));
    }
    let attributes = (0..mesh.num_attributes())
        .map(|index| {
            let attribute = mesh.try_attribute(index).map_err(|error| broken(format!("Draco: {error}")))?;
            let component_type = component_type(attribute.data_type())?;
            let (components, stride) = (attribute.num_components(), attribute.byte_stride());
            let size = usize::from(components) * attribute.data_type().byte_length();
            let stride = usize::try_from(stride).ok().filter(|&stride| stride >= size && (1..=4).contains(&components));
            let stride = stride.ok_or_else(|| broken("Draco: an attribute has an absurd layout"))?;
            let data = attribute.buffer().data();
            let mut values = Vec::with_capacity(size * vertices as usize);
            for vertex in 0..vertices {
                let at = (attribute.mapped_index(PointIndex(vertex)).0 as usize).checked_mul(stride);
                let element = at.and_then(|at| data.get(at..)?.get(..size));
                values.extend_from_slice(element.ok_or_else(|| broken("Draco: a vertex lacks an attribute"))?);
            }
            Ok(Attribute { id: attribute.unique_id(), component_type, components: u32::from(components), values })
        })
        .collect::<Result<_>>()?;
    Ok(Mesh { vertices, indices, attributes })
}

/// glTF's number for a component type.
fn component_type(of: DataType) -> Result<u32> {
    Ok(match of {
        DataType::Int8 => 5120,
        DataType::Uint8 => 5121,
        DataType::Int16 => 5122,
        DataType::Uint16 => 5123,
        DataType::Uint32 => 5125,
        DataType::Float32 => 5126,
        other => return Err(broken(format!("Draco: an attribute of {other:?}, which glTF does not have"))),
    })
}
