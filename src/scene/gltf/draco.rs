//! `KHR_draco_mesh_compression`: the accessors of a primitive in one compressed run of bytes.

use super::buffers::Buffers;
use super::container::Document;
use super::decoders::DRACO;
use super::mesh::Budget;
use crate::error::Result;
use gltf::json::accessor::{ComponentType, Type};
use gltf::json::mesh::Primitive;
use restir_decoders::draco::{self, Attribute as DracoAttribute, Mesh as DracoMesh};
use serde_json::{Map, Value};

/// A decompressed primitive.
pub(super) struct Draco {
    mesh: DracoMesh,
    /// By semantic, the ids of its attributes.
    ids: Map<String, Value>,
}

/// One of its attributes.
pub(super) struct Attribute<'a>(&'a DracoAttribute);

impl Draco {
    /// Decompresses `primitive`, if it is compressed.
    pub fn load(
        document: &Document,
        buffers: &Buffers,
        budget: &mut Budget,
        primitive: &Primitive,
        place: &str,
    ) -> Result<Option<Draco>> {
        let extension = primitive.extensions.as_ref().and_then(|extensions| extensions.others.get(DRACO));
        let Some(extension) = extension else { return Ok(None) };
        let place = format!("{place}.extensions.{DRACO}");
        let view = extension.get("bufferView").and_then(Value::as_u64).and_then(|view| usize::try_from(view).ok());
        let view = view.ok_or_else(|| document.bad(&place, "it has no bufferView"))?;
        let (bytes, _) = buffers.view(document, view, &place)?;
        let mesh = document.decode(&place, || draco::decode(bytes, budget.left()))?;
        let attributes: usize = mesh.attributes.iter().map(|attribute| attribute.values.len()).sum();
        budget.charge(document, attributes as u64 + mesh.indices.len() as u64 * 4)?;
        let ids = extension.get("attributes").and_then(Value::as_object);
        let ids = ids.ok_or_else(|| document.bad(&place, "it has no attributes"))?.clone();
        for (semantic, id) in &ids {
            if !mesh.attributes.iter().any(|attribute| id.as_u64() == Some(attribute.id.into())) {
                return Err(
                    document.bad(format!("{place}.attributes.{}", super::tidy(semantic)), "there is no such attribute")
                );
            }
        }
        Ok(Some(Draco { mesh, ids }))
    }

    /// The attribute of a semantic, if it was compressed.
    pub fn attribute(&self, semantic: &str) -> Option<Attribute<'_>> {
        let id = self.ids.get(semantic)?.as_u64()?;
        self.mesh.attributes.iter().find(|attribute| u64::from(attribute.id) == id).map(Attribute)
    }

    /// Three a triangle, all below the number of vertices.
    pub fn indices(&self) -> &[u32] {
        &self.mesh.indices
    }
}

impl<'a> Attribute<'a> {
    /// The elements, tightly packed.
    pub fn values(&self) -> &'a [u8] {
        &self.0.values
    }

    /// What an element is.
    pub fn kind(&self, document: &Document, place: &str) -> Result<(Type, ComponentType)> {
        let kind = match self.0.components {
            1 => Type::Scalar,
            2 => Type::Vec2,
            3 => Type::Vec3,
            _ => Type::Vec4,
        };
        let component = match self.0.component_type {
            5120 => ComponentType::I8,
            5121 => ComponentType::U8,
            5122 => ComponentType::I16,
            5123 => ComponentType::U16,
            5125 => ComponentType::U32,
            5126 => ComponentType::F32,
            other => return Err(document.bad(place, format!("its components are of an unknown type {other}"))),
        };
        Ok((kind, component))
    }
}
