//! Every way an operation can fail, with one clear line for a person and one stable code for a program.

use restir_decoders::Fault;

/// The result of every fallible operation of this crate.
pub type Result<T> = std::result::Result<T, Error>;

/// What went wrong. `Display` is one line for a person; [`Error::code`] is stable for a program.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A file could not be read or written.
    #[error("{path}: {source}")]
    Io {
        /// The file as the caller named it.
        path: String,
        /// What the operating system said.
        source: std::io::Error,
    },
    /// A scene, image or environment file is broken or hostile.
    #[error("{file}: {what} (at {place})")]
    BadFile {
        /// The file as the caller named it.
        file: String,
        /// Where in the file: a JSON path, a chunk or a byte offset.
        place: String,
        /// What is wrong there.
        what: String,
    },
    /// A file is sound but needs something this version does not have.
    #[error("{file}: {what} is not supported")]
    Unsupported {
        /// The file as the caller named it.
        file: String,
        /// The extension or feature.
        what: String,
    },
    /// A name (scene, technique, parameter, view, camera) is not known.
    #[error("unknown {kind} '{name}'; {}", if known.is_empty() { "there are none".into() } else { format!("known: {known}") })]
    Unknown {
        /// What kind of thing was named.
        kind: &'static str,
        /// The name given.
        name: String,
        /// The names that would have been right, comma-separated.
        known: String,
    },
    /// A value is out of its range or of the wrong type.
    #[error("{name}: {what}")]
    BadValue {
        /// The parameter or option.
        name: String,
        /// What is wrong and what would be right.
        what: String,
    },
    /// No WebGPU adapter was found, or the device could not be made.
    #[error("no usable graphics adapter: {0}")]
    NoAdapter(String),
    /// More than the device, or this program, allows.
    #[error("{what}: {wanted} {unit} wanted, at most {had} allowed")]
    Limit {
        /// The resource.
        what: String,
        /// The number wanted.
        wanted: u64,
        /// The number allowed.
        had: u64,
        /// The unit of both.
        unit: &'static str,
    },
    /// The device was lost or an operation on it failed.
    #[error("graphics device: {0}")]
    Device(String),
    /// A shader does not compile, or a pass was bound wrongly.
    #[error("shader {shader}: {what}")]
    Shader {
        /// Which pass.
        shader: String,
        /// What is wrong, with source file and line where known.
        what: String,
    },
}

impl Error {
    /// A stable, upper-case identifier for programs (the page maps it to advice).
    pub fn code(&self) -> &'static str {
        match self {
            Error::Io { .. } => "IO",
            Error::BadFile { .. } => "BAD_FILE",
            Error::Unsupported { .. } => "UNSUPPORTED",
            Error::Unknown { .. } => "UNKNOWN_NAME",
            Error::BadValue { .. } => "BAD_VALUE",
            Error::NoAdapter(_) => "NO_ADAPTER",
            Error::Limit { .. } => "LIMIT",
            Error::Device(_) => "DEVICE",
            Error::Shader { .. } => "SHADER",
        }
    }

    /// What a decoder says of a file; the part of its message before a colon is where.
    pub(crate) fn of_fault(file: &str, fault: Fault) -> Self {
        match fault {
            Fault::Broken(what) => {
                let (place, what) = what.split_once(": ").unwrap_or(("file", &what));
                Error::bad_file(file, place, what)
            }
            Fault::Unsupported(what) => Error::Unsupported { file: file.to_owned(), what },
            Fault::TooLarge { pixels, most } => {
                Error::Limit { what: format!("{file}: the picture"), wanted: pixels, had: most, unit: "pixels" }
            }
        }
    }

    /// An [`Error::BadFile`] from its parts.
    pub fn bad_file(file: impl Into<String>, place: impl Into<String>, what: impl Into<String>) -> Self {
        Error::BadFile { file: file.into(), place: place.into(), what: what.into() }
    }

    /// An [`Error::BadValue`] from its parts.
    pub fn bad_value(name: impl Into<String>, what: impl Into<String>) -> Self {
        Error::BadValue { name: name.into(), what: what.into() }
    }
}
