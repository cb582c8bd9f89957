//! Faults planted in the shaders of a running program, in memory: what a test of truth must catch. Native only.

use super::Gpu;
use super::shader::table;
use super::shader_source::Flattened;
use crate::error::{Error, Result};

impl Gpu {
    /// Puts `new` in the place of `old` in every pass that has it, from the next frame on. All handles on this device see
    /// it: plant on a device of its own.
    ///
    /// # Errors
    /// `SHADER` where no pass has `old` or one has it more than once, or where what comes of it does not compile or binds
    /// other things.
    pub fn plant(&self, old: &str, new: &str) -> Result<()> {
        let fault = |shader: &str, what: String| Error::Shader { shader: shader.to_owned(), what };
        let mut edits = Vec::new();
        for shader in table::ALL {
            let text = self.shader_source(shader);
            match text.matches(old).count() {
                0 => {}
                1 => {
                    let text = text.replace(old, new);
                    let flattened = Flattened { text, ..Flattened::default() };
                    shader.accepts(&flattened).map_err(|what| fault(shader.id, what))?;
                    edits.push((shader.id, flattened.text));
                }
                count => return Err(fault(shader.id, format!("'{old}' stands there {count} times"))),
            }
        }
        if edits.is_empty() {
            return Err(fault("all", format!("'{old}' stands nowhere")));
        }
        if let (Ok(mut pipelines), Ok(mut planted)) = (self.pipelines.lock(), self.planted.lock()) {
            for (id, text) in edits {
                pipelines.retain(|(made, _), _| *made != id);
                planted.insert(id, text);
            }
        }
        Ok(())
    }
}
