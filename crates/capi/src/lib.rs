//! The C interface: open a store, list the tiles to search, locate a camera frame.
//!
//! `include/overfly.h` is generated from this crate by cbindgen; `examples/c/fix.c` shows its use.
//!
//! # Rules
//! - Every function that can fail returns an `overfly_status`. After `OVERFLY_FAILED` the functions
//!   `overfly_last_error_code` and `overfly_last_error_message` say why, for the calling thread.
//! - A null pointer where an object is required is an error, not undefined behaviour. A pointer that is not null must be valid.
//! - What a function hands out by an out parameter belongs to the caller, who frees it with the function of the same name
//!   (`overfly_store_free`, ...). Freeing null does nothing. On failure the out parameter becomes null.
//! - A store may be used by several threads at once. A frame may be read by several threads at once.
//! - No panic crosses the border: a panic is reported as the error `internal_error`.
//! - NaN in a request means "not stated".

#![allow(non_camel_case_types, reason = "types are named as C spells them")]

mod border;
mod candidates;
mod error;
mod fix;
mod frame;
mod store;

pub use candidates::{
    overfly_candidate, overfly_candidate_request, overfly_candidate_request_new, overfly_candidates,
    overfly_candidates_find, overfly_candidates_free,
};
pub use error::{overfly_last_error_code, overfly_last_error_message, overfly_status};
pub use fix::{
    overfly_camera, overfly_fix, overfly_fix_request, overfly_fix_request_new, overfly_locate, overfly_no_fix,
    overfly_position_of,
};
pub use frame::{overfly_frame, overfly_frame_decode, overfly_frame_free, overfly_frame_from_gray};
pub use store::{overfly_store, overfly_store_free, overfly_store_open, overfly_version};
