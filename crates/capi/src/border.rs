//! Pointers, strings and optional numbers across the border.

use crate::error::CallError;
use std::ffi::{CStr, c_char};
use std::ptr::NonNull;

/// A C string as text; `None` for null.
///
/// # Safety
/// `pointer` is null or points to a string that ends with a zero byte.
pub unsafe fn optional<'a>(pointer: *const c_char, name: &str) -> Result<Option<&'a str>, CallError> {
    if pointer.is_null() {
        return Ok(None);
    }
    let text = unsafe { CStr::from_ptr(pointer) }.to_str();
    text.map(Some).map_err(|_| CallError::bad_argument(format!("{name} is not UTF-8")))
}

/// The object behind a pointer.
///
/// # Safety
/// `pointer` is null or points to an object that lives as long as `'a` and that nobody changes meanwhile.
pub unsafe fn object<'a, T>(pointer: *const T, name: &str) -> Result<&'a T, CallError> {
    unsafe { pointer.as_ref() }.ok_or_else(|| CallError::bad_argument(format!("{name} is null")))
}

/// Memory of the caller that takes a result; what it holds before is never read.
pub struct Place<T>(NonNull<T>);

impl<T> Place<T> {
    /// The place behind an out parameter.
    ///
    /// # Safety
    /// `pointer` is null or points to memory of a `T` that may be written as long as the place is used.
    pub unsafe fn new(pointer: *mut T, name: &str) -> Result<Self, CallError> {
        NonNull::new(pointer).map(Self).ok_or_else(|| CallError::bad_argument(format!("{name} is null")))
    }

    /// Writes the result.
    pub fn set(&self, value: T) {
        unsafe { self.0.as_ptr().write(value) }
    }
}

/// A number that was stated: not NaN.
pub fn stated(value: f64) -> Option<f64> {
    (!value.is_nan()).then_some(value)
}

/// A text in a C array: cut off between characters where it is too long, always with a zero byte at its end.
pub fn fixed<const N: usize>(text: &str) -> [c_char; N] {
    let mut end = text.len().min(N - 1);
    while !text.is_char_boundary(end) {
        end -= 1;
    }
    let mut out = [0; N];
    for (to, from) in out.iter_mut().zip(&text.as_bytes()[..end]) {
        *to = *from as c_char;
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_text_too_long_is_cut_off_between_characters() {
        let bytes = |text: [c_char; 4]| text.map(|c| c as u8);
        assert_eq!(bytes(fixed("ab")), *b"ab\0\0");
        assert_eq!(bytes(fixed("abcd")), *b"abc\0");
        assert_eq!(bytes(fixed("ab\u{e9}")), *b"ab\0\0");
        assert_eq!(stated(f64::NAN), None);
    }

    #[test]
    fn null_and_broken_texts_are_told_apart() {
        let broken = [0xff_u8, 0];
        unsafe {
            assert!(optional(std::ptr::null(), "layer").unwrap().is_none());
            assert!(optional(broken.as_ptr().cast(), "layer").is_err());
            assert_eq!(optional(c"ortho".as_ptr(), "layer").unwrap(), Some("ortho"));
            assert!(object::<u8>(std::ptr::null(), "store").is_err());
        }
    }
}
