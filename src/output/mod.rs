//! Pictures.

/// A linear Rec. 709 picture, row-major from the top.
#[derive(Debug, Clone, PartialEq)]
pub struct Image {
    /// Width in pixels.
    pub width: u32,
    /// Height in pixels.
    pub height: u32,
    /// RGB radiance.
    pub pixels: Vec<[f32; 3]>,
}
