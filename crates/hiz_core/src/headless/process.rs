//! Which process a device belongs to, so that a fork can be refused.

use crate::error::{Error, Result};

/// The process that made something, by its id.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Process(u32);

impl Process {
    pub(super) fn this() -> Self {
        Self(std::process::id())
    }

    /// [`Error::OtherProcess`] if this process is not the one that made it.
    /// Takes no lock.
    pub(super) fn check(self) -> Result<()> {
        let here = Self::this();
        if self == here {
            Ok(())
        } else {
            Err(Error::OtherProcess { made_by: self.0, here: here.0 })
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn another_process_is_named_beside_this_one() {
        assert!(Process::this().check().is_ok());
        // No process has this id: it is the largest that the type holds, and ids on Linux end at
        // 2^22.
        let text = Process(u32::MAX).check().unwrap_err().to_string();
        let here = std::process::id();
        assert_eq!(
            text,
            format!(
                "this device was made by process 4294967295, and process {here} is a fork of it: \
                 no device works after a fork. Make one in this process, or start processes \
                 without a fork"
            )
        );
    }
}
