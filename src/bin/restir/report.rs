//! What goes to stdout.

use crate::failure::{Failure, Result};
use serde::Serialize;
use std::io::{ErrorKind, Write};

/// Prints a line, or several.
pub fn text(line: &str) -> Result<()> {
    let mut out = std::io::stdout().lock();
    writeln!(out, "{line}").and_then(|()| out.flush()).map_err(|source| match source.kind() {
        ErrorKind::BrokenPipe => Failure::OutputClosed,
        _ => Failure::Failed(restir::Error::Io { path: "stdout".into(), source }),
    })
}

/// Prints a value as indented JSON. Numbers that JSON has no word for (infinity) become null.
pub fn json(value: &impl Serialize) -> Result<()> {
    let rendered = serde_json::to_string_pretty(value)
        .map_err(|error| Failure::Failed(restir::Error::Io { path: "stdout".into(), source: error.into() }))?;
    text(&rendered)
}

/// Passes each warning on to stderr in one line, if it can be written.
pub fn warnings<'a>(warnings: impl IntoIterator<Item = &'a String>) {
    for warning in warnings {
        let _ = writeln!(std::io::stderr(), "warning: {warning}");
    }
}
