//! The store: opened read-only, freed by the caller.

use crate::border::{Place, optional};
use crate::error::{CallError, call, overfly_status, release};
use ::overfly_store::Reader;
use std::ffi::c_char;
use std::path::Path;

/// An open store. Nothing in this interface writes to it.
pub struct overfly_store {
    pub(crate) reader: Reader,
}

/// Opens the store (a GeoPackage) at `path`, UTF-8, read-only, and sets `*store`, which the caller frees with
/// `overfly_store_free`. On failure `*store` is null.
///
/// # Safety
/// `path` is a string with a zero byte at its end, and `store` may be written; either may be null, which is an error.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn overfly_store_open(path: *const c_char, store: *mut *mut overfly_store) -> overfly_status {
    call(|| {
        let out = unsafe { Place::new(store, "store") }?;
        out.set(std::ptr::null_mut());
        let path = unsafe { optional(path, "path") }?.ok_or_else(|| CallError::bad_argument("path is null"))?;
        let reader = Reader::open(Path::new(path))?;
        out.set(Box::into_raw(Box::new(overfly_store { reader })));
        Ok(overfly_status::OVERFLY_OK)
    })
}

/// Closes a store. Null does nothing.
///
/// # Safety
/// `store` is null or comes from `overfly_store_open`, and is not used afterwards.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn overfly_store_free(store: *mut overfly_store) {
    if !store.is_null() {
        release(|| drop(unsafe { Box::from_raw(store) }));
    }
}

/// Returns the version of the library, such as `0.1.0`. The text is valid for ever.
#[unsafe(no_mangle)]
pub extern "C" fn overfly_version() -> *const c_char {
    concat!(env!("CARGO_PKG_VERSION"), "\0").as_ptr().cast()
}
