//! How a command ends badly.

use restir::Error;
use std::process::ExitCode;

pub type Result<T> = std::result::Result<T, Failure>;

/// Why a command did not do its work.
#[derive(Debug)]
pub enum Failure {
    /// What was asked for makes no sense: exit code 2.
    Usage(Error),
    /// It could not be done: exit code 1.
    Failed(Error),
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

    /// Says it in one line on stderr, and gives the exit code.
    pub fn report(&self) -> ExitCode {
        let (error, code) = match self {
            Failure::Usage(error) => (error, 2),
            Failure::Failed(error) => (error, 1),
            Failure::OutputClosed => return ExitCode::SUCCESS,
        };
        let line = error.to_string().split_whitespace().collect::<Vec<_>>().join(" ");
        eprintln!("error[{}]: {line}", error.code());
        ExitCode::from(code)
    }
}

impl From<Error> for Failure {
    fn from(error: Error) -> Self {
        Failure::Failed(error)
    }
}
