//! Errors: what can go wrong in a call.
//!
//! Each message names the parameter, what was expected and what was given.

/// An error of this crate.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// No adapter of the built backends fits the request.
    #[error("no adapter {request}; seen: {}. {hint}", listed(seen))]
    NoAdapter {
        /// What was asked for, in words.
        request: String,
        /// The adapters that were found.
        seen: Vec<String>,
        /// What to do: how to choose one of these adapters, or the command that installs a software
        /// driver.
        hint: String,
    },
    /// A request exceeds a limit of the device.
    #[error("{name}: requested {requested}, the device allows {allowed}")]
    Limit {
        /// The name of the limit; for limits of WebGPU, the specification's name.
        name: String,
        /// How much the request needs.
        requested: u64,
        /// How much the device allows.
        allowed: u64,
    },
    /// The value of a parameter cannot be used.
    #[error("{parameter}: {message}")]
    Invalid {
        /// The parameter's name.
        parameter: String,
        /// What was expected and what was given.
        message: String,
    },
    /// The objects do not belong together.
    /// They differ in camera, size or device, or the pyramid was never built.
    #[error("{parameter}: {message}")]
    Mismatch {
        /// The parameter's name.
        parameter: String,
        /// What was expected and what was given.
        message: String,
    },
    /// The device belongs to the process that this one was forked from.
    /// A fork has none of the driver's threads, so a call would wait forever.
    #[error(
        "this device was made by process {made_by}, and process {here} is a fork of it: no device \
         works after a fork. Make one in this process, or start processes without a fork"
    )]
    OtherProcess {
        /// The id of the process that made the device.
        made_by: u32,
        /// The id of this process.
        here: u32,
    },
    /// The device was lost, and everything on it is gone.
    /// The text gives the reason.
    #[error("the device was lost: {0}")]
    DeviceLost(String),
    /// The device or the host ran out of memory.
    /// The text says for what.
    #[error("out of memory: {0}")]
    OutOfMemory(String),
    /// The driver or wgpu refused something that this crate believes to be valid.
    /// This is a bug; please report it.
    #[error("the device reported an error: {0}")]
    Device(String),
}

impl Error {
    pub(crate) fn invalid(parameter: &str, message: impl Into<String>) -> Self {
        Self::Invalid { parameter: parameter.to_owned(), message: message.into() }
    }

    pub(crate) fn mismatch(parameter: &str, message: impl Into<String>) -> Self {
        Self::Mismatch { parameter: parameter.to_owned(), message: message.into() }
    }

    pub(crate) fn limit(name: &str, requested: u64, allowed: u64) -> Self {
        Self::Limit { name: name.to_owned(), requested, allowed }
    }
}

fn listed(seen: &[String]) -> String {
    if seen.is_empty() { "none".to_owned() } else { seen.join(", ") }
}

/// The result of a fallible call of this crate.
pub type Result<T> = std::result::Result<T, Error>;
