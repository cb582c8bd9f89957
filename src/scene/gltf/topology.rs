//! Triangle lists from lists, strips and fans.

use gltf::json::mesh::Mode;

/// Corners of a triangle list, three a triangle, or none for points and lines. Corners that complete no triangle are
/// dropped. Source: specification, section 3.7.2.1.
pub(super) fn triangles(mode: Mode, corners: Vec<u32>) -> Option<Vec<u32>> {
    match mode {
        Mode::Triangles => {
            let mut corners = corners;
            corners.truncate(corners.len() / 3 * 3);
            Some(corners)
        }
        Mode::TriangleStrip => Some(
            corners
                .windows(3)
                .enumerate()
                // Every second triangle is turned round so that all face the same way.
                .flat_map(|(i, t)| if i % 2 == 0 { [t[0], t[1], t[2]] } else { [t[0], t[2], t[1]] })
                .collect(),
        ),
        Mode::TriangleFan => {
            let rim = corners.get(1..).unwrap_or_default();
            Some(rim.windows(2).flat_map(|edge| [edge[0], edge[1], corners[0]]).collect())
        }
        Mode::Points | Mode::Lines | Mode::LineLoop | Mode::LineStrip => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn strips_and_fans_keep_their_winding() {
        let strip = triangles(Mode::TriangleStrip, vec![0, 1, 2, 3]);
        assert_eq!(strip, Some(vec![0, 1, 2, 1, 3, 2]));
        assert_eq!(triangles(Mode::TriangleFan, vec![0, 1, 2, 3]), Some(vec![1, 2, 0, 2, 3, 0]));
        assert_eq!(triangles(Mode::Triangles, vec![0, 1, 2, 3]), Some(vec![0, 1, 2]));
        assert_eq!(triangles(Mode::TriangleFan, vec![]), Some(vec![]));
        assert_eq!(triangles(Mode::Lines, vec![0, 1]), None);
    }
}
