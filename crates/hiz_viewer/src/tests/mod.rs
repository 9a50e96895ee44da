//! Tests of the whole: `pictures` compares frames, `scenes` checks what scenes say of themselves.

mod pictures;
mod scenes;
