//! What is made on the device, each with what wgpu finds wrong with it as an error, at once.
//!
//! wgpu reports errors to the device's handler, which ends the process unless the caller has set
//! another one.
//! Error scopes belong to a thread and are popped at once, so a scope around each call catches that
//! call's own errors and nobody else's.
//! It has to be each call: an object that could not be made must not get into the caller's encoder,
//! whose `finish` would fail for it.

use std::future::Future;
use std::pin::pin;
use std::task::{Context, Poll, Waker};

use crate::error::{Error, Result};

/// Runs `make`, and gives what wgpu finds wrong as an error.
pub(crate) fn checked<T>(device: &wgpu::Device, make: impl FnOnce() -> T) -> Result<T> {
    let memory = device.push_error_scope(wgpu::ErrorFilter::OutOfMemory);
    let validation = device.push_error_scope(wgpu::ErrorFilter::Validation);
    let internal = device.push_error_scope(wgpu::ErrorFilter::Internal);
    let made = make();
    // The innermost scope goes first.
    let internal = found(internal.pop());
    let validation = found(validation.pop());
    let memory = found(memory.pop());
    match (memory, internal.or(validation)) {
        (Some(error), _) => Err(Error::OutOfMemory(in_a_line(&error))),
        (None, Some(error)) => Err(Error::Device(in_a_line(&error))),
        (None, None) => Ok(made),
    }
}

/// What wgpu says, from the call down to the cause.
fn in_a_line(error: &wgpu::Error) -> String {
    let causes = std::iter::successors(std::error::Error::source(error), |error| error.source());
    let texts: Vec<_> = causes.map(|cause| cause.to_string().replace('\n', " ")).collect();
    if texts.is_empty() { error.to_string() } else { texts.join(": ") }
}

/// What a scope has caught.
/// Where wgpu runs natively it is there as soon as the scope is popped; elsewhere it is not waited
/// for.
fn found(scope: impl Future<Output = Option<wgpu::Error>>) -> Option<wgpu::Error> {
    match pin!(scope).poll(&mut Context::from_waker(Waker::noop())) {
        Poll::Ready(error) => error,
        Poll::Pending => None,
    }
}
