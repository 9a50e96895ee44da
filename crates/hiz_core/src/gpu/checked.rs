//! Error scopes around everything that is made on the device.
//!
//! wgpu reports errors to the device's handler.
//! Unless the caller has set another handler, that ends the process.
//! Error scopes belong to a thread.
//! A scope that is pushed before a call and popped right after it therefore catches the errors of
//! that call alone.
//! Each call needs a scope of its own.
//! An invalid object must not get into the caller's encoder, since its `finish` would fail.

use std::future::Future;
use std::pin::pin;
use std::task::{Context, Poll, Waker};

use crate::error::{Error, Result};

/// Runs `make`, and returns what wgpu reports meanwhile as an error.
///
/// # Errors
/// [`Error::OutOfMemory`], or [`Error::Device`] for validation errors and internal errors.
pub(crate) fn checked<T>(device: &wgpu::Device, make: impl FnOnce() -> T) -> Result<T> {
    let memory = device.push_error_scope(wgpu::ErrorFilter::OutOfMemory);
    let validation = device.push_error_scope(wgpu::ErrorFilter::Validation);
    let internal = device.push_error_scope(wgpu::ErrorFilter::Internal);
    let made = make();
    // Scopes are popped from the innermost outwards.
    let internal = found(internal.pop());
    let validation = found(validation.pop());
    let memory = found(memory.pop());
    match (memory, internal.or(validation)) {
        (Some(error), _) => Err(Error::OutOfMemory(in_a_line(&error))),
        (None, Some(error)) => Err(Error::Device(in_a_line(&error))),
        (None, None) => Ok(made),
    }
}

/// wgpu's messages in one line, from the failing call down to the cause.
fn in_a_line(error: &wgpu::Error) -> String {
    let causes = std::iter::successors(std::error::Error::source(error), |error| error.source());
    let texts: Vec<_> = causes.map(|cause| cause.to_string().replace('\n', " ")).collect();
    if texts.is_empty() { error.to_string() } else { texts.join(": ") }
}

/// The error that a scope has caught.
///
/// A native wgpu knows it as soon as the scope is popped.
/// Elsewhere it would have to be awaited, and this returns `None`.
fn found(scope: impl Future<Output = Option<wgpu::Error>>) -> Option<wgpu::Error> {
    match pin!(scope).poll(&mut Context::from_waker(Waker::noop())) {
        Poll::Ready(error) => error,
        Poll::Pending => None,
    }
}
