//! The cull: it tests one set of instances against one pyramid, for one camera.
//!
//! The data goes through these files:
//!
//! 1. `options` has the caller's choices, and `inputs` gathers instances, camera, pyramid and
//!    options.
//! 2. `view_uniform` turns the camera and the options into the numbers that the shaders read.
//!    `lod` adds those that choose levels of detail.
//! 3. `pipelines` picks the pipeline that fits the options.
//! 4. `record` records the pass; `groups` adds the test of whole groups before their members.
//!    `full_mask` has masks of which only what is culled is written.
//!    `among` restricts it to some of the instances, and `views` culls for several cameras.
//! 5. `history`, `early` and `late` are the two passes of a frame: the early one draws what was
//!    visible before, and the late one tests all against the depth of that.
//! 6. `pixels` counts the pixels of each instance, where that is asked for, and `approximate` culls
//!    what shows in few of them.
//! 7. `shadow` has the numbers of a cull of shadow casters, whose volumes are swept along a light.
//! 8. `warm_up` does all of it once without workgroups, before the first frame.
//! 9. Later, and only if they are read: `refine` completes the verdicts, `count` counts them, and
//!    `explain` repeats one test.
//!
//! This room records commands into an encoder; it never submits or waits.

pub(crate) mod among;
pub(crate) mod approximate;
#[cfg(feature = "headless")]
pub(crate) mod count;
pub(crate) mod descent;
pub(crate) mod early;
#[cfg(feature = "headless")]
pub(crate) mod explain;
pub(crate) mod full_mask;
pub(crate) mod groups;
pub(crate) mod history;
pub(crate) mod inputs;
pub(crate) mod late;
pub(crate) mod lod;
pub(crate) mod no_depth;
pub(crate) mod options;
pub(crate) mod pipelines;
pub(crate) mod pixels;
pub(crate) mod record;
#[cfg(feature = "headless")]
pub(crate) mod refine;
pub(crate) mod shadow;
pub(crate) mod view_uniform;
pub(crate) mod views;
pub(crate) mod warm_up;
