//! Names of cached things: a hash of everything that determines them.

use crate::gpu::shader::table;
use std::fmt::Write as _;

/// FNV-1a of 128 bits (Fowler, Noll and Vo): of what nobody chooses in order to collide.
#[derive(Debug, Clone, Copy)]
pub struct Hasher(u128);

impl Default for Hasher {
    fn default() -> Self {
        Hasher(0x6c62_272e_07bb_0142_62b8_2175_6295_c58d)
    }
}

impl Hasher {
    /// Takes bytes in.
    pub fn add(mut self, bytes: &[u8]) -> Self {
        for byte in bytes {
            self.0 = (self.0 ^ u128::from(*byte)).wrapping_mul(0x0000_0000_0100_0000_0000_0000_0000_013b);
        }
        self
    }

    /// 32 hexadecimal digits.
    pub fn hex(self) -> String {
        let mut text = String::new();
        let _ = write!(text, "{:032x}", self.0);
        text
    }
}

/// The hash of one text.
pub fn of(text: &str) -> String {
    Hasher::default().add(text.as_bytes()).hex()
}

/// The version of the shaders that are recorded in a frame of any technique for which `wanted` holds, by the folder that
/// their ids begin with.
pub fn shaders(wanted: impl Fn(&str) -> bool) -> String {
    let mut hasher = Hasher::default();
    for shader in table::ALL {
        let folder = shader.id.split('/').next().unwrap_or_default();
        if wanted(folder) {
            hasher = hasher.add(shader.id.as_bytes()).add(shader.source.as_bytes());
        }
    }
    hasher.hex()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn published_values() {
        // The offset basis, and "a" as published with the algorithm.
        assert_eq!(of(""), "6c62272e07bb014262b821756295c58d");
        assert_eq!(of("a"), "d228cb696f1a8caf78912b704e4a8964");
    }
}
