//! What can go wrong, each with a message that names the parameter, what was expected and what
//! came.

/// The errors of this crate.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// No Vulkan adapter fits the request.
    #[error("no Vulkan adapter {request}; seen: {}. {hint}", if seen.is_empty() { "none".to_owned() } else { seen.join(", ") })]
    NoAdapter {
        /// What was asked for, in words.
        request: String,
        /// The adapters that were there.
        seen: Vec<String>,
        /// The exact line that installs a software driver.
        hint: String,
    },
    /// A request goes past a limit of the device.
    #[error("{name}: requested {requested}, the device allows {allowed}")]
    Limit {
        /// The limit, in the words of the WebGPU specification.
        name: String,
        /// What the request would need.
        requested: u64,
        /// What the device has.
        allowed: u64,
    },
    /// A parameter cannot be used.
    #[error("{parameter}: {message}")]
    Invalid {
        /// The parameter's name.
        parameter: String,
        /// What was expected and what came.
        message: String,
    },
    /// Objects that do not belong together: another camera, size, device, or a pyramid that was
    /// never built.
    #[error("{parameter}: {message}")]
    Mismatch {
        /// The parameter's name.
        parameter: String,
        /// What was expected and what came.
        message: String,
    },
    /// The device belongs to another process, of which this one is a fork.
    /// What a driver keeps beside it, threads above all, stays behind in a fork: a call would wait
    /// for ever.
    #[error(
        "this device was made by process {made_by}, and process {here} is a fork of it: no device works after a fork. Make one in \
         this process, or start processes without a fork"
    )]
    OtherProcess {
        /// The process that made the device.
        made_by: u32,
        /// This process.
        here: u32,
    },
    /// The device was lost; everything that lives on it is gone.
    #[error("the device was lost: {0}")]
    DeviceLost(String),
    /// The device ran out of memory, or the host did.
    #[error("out of memory: {0}")]
    OutOfMemory(String),
    /// The driver or wgpu refused something that this crate believes to be right: a bug worth
    /// reporting.
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

/// This crate's results.
pub type Result<T> = std::result::Result<T, Error>;
