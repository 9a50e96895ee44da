//! Tests of the whole: `pictures` compares frames, `scenes` checks what scenes say of themselves.
//! `samples` finds where samples lie, and what a driver that misplaces their depths may differ in.

mod pictures;
mod samples;
mod scenes;
