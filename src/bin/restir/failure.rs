//! How a command ends badly.

use clap::error::ErrorKind;
use restir::Error;
use std::io::Write;
use std::process::ExitCode;

pub type Result<T> = std::result::Result<T, Failure>;

/// Why a command did not do its work.
#[derive(Debug)]
pub enum Failure {
    /// What was asked for makes no sense: exit code 2.
    Usage(Error),
    /// It could not be done: exit code 1.
    Failed(Error),
    /// The arguments could not be parsed: exit code 2.
    Arguments(clap::Error),
    /// Whoever read our output has closed it (`| head`): no error to speak of.
    OutputClosed,
}

impl Failure {
    /// A wrong value of an option.
    pub fn usage(option: &str, what: impl Into<String>) -> Self {
        Failure::Usage(Error::bad_value(option, what))
    }

    /// An error made by a value that was given on the command line: wrong usage where the value or name is at fault.
    pub fn from_option(error: Error) -> Self {
        match error {
            Error::BadValue { .. } | Error::Unknown { .. } => Failure::Usage(error),
            _ => Failure::Failed(error),
        }
    }

    /// Says it in one line on stderr, and gives the exit code. Help and version that were asked for are printed whole.
    pub fn report(&self) -> ExitCode {
        match self {
            Failure::Usage(error) => tell(error.code(), &error.to_string(), 2),
            Failure::Failed(error) => tell(error.code(), &error.to_string(), 1),
            Failure::Arguments(error) if is_help(error.kind()) => error.exit(),
            Failure::Arguments(error) => tell("USAGE", &summary(error), 2),
            Failure::OutputClosed => ExitCode::SUCCESS,
        }
    }
}

/// One line on stderr. Where that cannot be written there is nobody to tell.
fn tell(code: &str, text: &str, exit: u8) -> ExitCode {
    let line = text.split_whitespace().collect::<Vec<_>>().join(" ");
    let _ = writeln!(std::io::stderr(), "error[{code}]: {line}");
    ExitCode::from(exit)
}

fn is_help(kind: ErrorKind) -> bool {
    use ErrorKind::{DisplayHelp, DisplayHelpOnMissingArgumentOrSubcommand, DisplayVersion};
    matches!(kind, DisplayHelp | DisplayHelpOnMissingArgumentOrSubcommand | DisplayVersion)
}

/// The first paragraph of what clap says, and where to read more.
fn summary(error: &clap::Error) -> String {
    let text = error.to_string();
    let first = text.split("\n\n").next().unwrap_or_default();
    format!("{} (try --help)", first.strip_prefix("error: ").unwrap_or(first).trim())
}

impl From<Error> for Failure {
    fn from(error: Error) -> Self {
        Failure::Failed(error)
    }
}
