//! Tests of several modules of this crate together.

mod old_formats;
