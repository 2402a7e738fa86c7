//! Errors at the border: the status that functions return, and the calling thread's last error.

use ::overfly_store::StoreError;
use overfly_flight::frame::FrameError;
use overfly_flight::locate::LocateError;
use overfly_flight::locate::candidates::CandidatesError;
use std::cell::RefCell;
use std::ffi::{CString, c_char};
use std::panic::{AssertUnwindSafe, catch_unwind};

/// How a call ended.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum overfly_status {
    /// Done; out parameters are set.
    OVERFLY_OK = 0,
    /// The search was made and found no fix. This is an answer, not an error: `overfly_no_fix` has the reason.
    OVERFLY_NO_FIX = 1,
    /// Failed; `overfly_last_error_code` and `overfly_last_error_message` say why.
    OVERFLY_FAILED = 2,
}

/// Why a call failed.
#[derive(Debug)]
pub struct CallError {
    code: &'static str,
    message: String,
}

impl CallError {
    /// A required pointer is null, or a value cannot be used.
    pub fn bad_argument(message: impl Into<String>) -> Self {
        Self { code: "bad_argument", message: message.into() }
    }
}

impl From<StoreError> for CallError {
    fn from(error: StoreError) -> Self {
        Self { code: error.code(), message: error.to_string() }
    }
}

impl From<FrameError> for CallError {
    fn from(error: FrameError) -> Self {
        Self { code: error.code(), message: error.to_string() }
    }
}

impl From<LocateError> for CallError {
    fn from(error: LocateError) -> Self {
        Self { code: error.code(), message: error.to_string() }
    }
}

impl From<CandidatesError> for CallError {
    fn from(error: CandidatesError) -> Self {
        Self { code: error.code(), message: error.to_string() }
    }
}

/// Code and message of the last failure, as C strings.
struct LastError {
    code: CString,
    message: CString,
}

thread_local! {
    static LAST_ERROR: RefCell<Option<LastError>> = const { RefCell::new(None) };
}

/// Runs one call: an error or a panic is kept as the thread's last error and becomes `OVERFLY_FAILED`.
pub fn call(body: impl FnOnce() -> Result<overfly_status, CallError>) -> overfly_status {
    let error = match catch_unwind(AssertUnwindSafe(body)) {
        Ok(Ok(status)) => return status,
        Ok(Err(error)) => error,
        Err(panic) => {
            let text = panic.downcast_ref::<&str>().map(|t| (*t).to_owned());
            let text = text.or_else(|| panic.downcast_ref::<String>().cloned());
            CallError { code: "internal_error", message: text.unwrap_or_else(|| "a panic without a message".into()) }
        }
    };
    let text = |text: String| CString::new(text.replace('\0', " ")).unwrap_or_default();
    let last = LastError { code: text(error.code.into()), message: text(error.message) };
    LAST_ERROR.with(|slot| *slot.borrow_mut() = Some(last));
    overfly_status::OVERFLY_FAILED
}

/// Runs the freeing of an object: nothing can be reported, and no panic leaves.
pub fn release(body: impl FnOnce()) {
    // A panic in a destructor has been printed by the panic hook; the caller could do nothing about it.
    let _ = catch_unwind(AssertUnwindSafe(body));
}

/// Returns the code word of the last failed call of this thread, such as `store_not_found`; null if none has failed.
/// Code words are stable. The text is valid until the next failed call of the same thread.
#[unsafe(no_mangle)]
pub extern "C" fn overfly_last_error_code() -> *const c_char {
    LAST_ERROR.with(|slot| slot.borrow().as_ref().map_or(std::ptr::null(), |last| last.code.as_ptr()))
}

/// Returns the message of the last failed call of this thread, UTF-8, for people; null if none has failed.
/// The text is valid until the next failed call of the same thread.
#[unsafe(no_mangle)]
pub extern "C" fn overfly_last_error_message() -> *const c_char {
    LAST_ERROR.with(|slot| slot.borrow().as_ref().map_or(std::ptr::null(), |last| last.message.as_ptr()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::ffi::CStr;

    fn last() -> (String, String) {
        let text = |pointer| unsafe { CStr::from_ptr(pointer) }.to_str().unwrap().to_owned();
        (text(overfly_last_error_code()), text(overfly_last_error_message()))
    }

    #[test]
    fn a_panic_becomes_an_error_of_its_thread() {
        assert!(overfly_last_error_code().is_null() && overfly_last_error_message().is_null());
        assert_eq!(call(|| panic!("went {}", "wrong")), overfly_status::OVERFLY_FAILED);
        assert_eq!(last(), ("internal_error".into(), "went wrong".into()));
        assert_eq!(call(|| Ok(overfly_status::OVERFLY_NO_FIX)), overfly_status::OVERFLY_NO_FIX);
        assert_eq!(last().0, "internal_error", "a call that did not fail leaves the last error");
        std::thread::spawn(|| assert!(overfly_last_error_code().is_null())).join().unwrap();
    }

    #[test]
    fn a_zero_byte_in_a_message_does_not_cut_it_off() {
        call(|| Err(CallError::bad_argument("a\0b")));
        assert_eq!(last(), ("bad_argument".into(), "a b".into()));
    }
}
