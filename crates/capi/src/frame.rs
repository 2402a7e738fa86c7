//! Camera frames: from gray pixels in memory, or decoded from the bytes of an image file.

use crate::border::Place;
use crate::error::{CallError, call, overfly_status, release};
use overfly_core::pixels::Gray;
use overfly_flight::frame::{FrameBounds, decode_frame};

/// A gray camera frame.
pub struct overfly_frame {
    pub(crate) gray: Gray,
}

/// Makes a frame of 8-bit gray pixels, which are copied, and sets `*frame`, which the caller frees with
/// `overfly_frame_free`. Row `y` starts at `pixels + y * stride_bytes`; `stride_bytes` is at least `width_px`. On failure
/// `*frame` is null.
///
/// # Safety
/// `pixels` points to `(height_px - 1) * stride_bytes + width_px` bytes, and `frame` may be written; either may be null,
/// which is an error.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn overfly_frame_from_gray(
    pixels: *const u8,
    width_px: u32,
    height_px: u32,
    stride_bytes: usize,
    frame: *mut *mut overfly_frame,
) -> overfly_status {
    call(|| {
        let out = unsafe { Place::new(frame, "frame") }?;
        out.set(std::ptr::null_mut());
        let (width, height) = checked_size(width_px, height_px)?;
        if pixels.is_null() {
            return Err(CallError::bad_argument("pixels is null"));
        }
        if stride_bytes < width {
            return Err(CallError::bad_argument(format!(
                "stride_bytes = {stride_bytes} is less than width_px = {width}"
            )));
        }
        let length = stride_bytes.checked_mul(height - 1).and_then(|n| n.checked_add(width));
        let length = length.filter(|n| isize::try_from(*n).is_ok());
        let length = length.ok_or_else(|| CallError::bad_argument("stride_bytes * height_px is too large"))?;
        let bytes = unsafe { std::slice::from_raw_parts(pixels, length) };
        let mut gray = Gray::filled(width, height, 0.0);
        for (row, from) in gray.values_mut().chunks_exact_mut(width).zip(bytes.chunks(stride_bytes)) {
            row.iter_mut().zip(from).for_each(|(to, from)| *to = f32::from(*from));
        }
        out.set(Box::into_raw(Box::new(overfly_frame { gray })));
        Ok(overfly_status::OVERFLY_OK)
    })
}

/// Decodes the bytes of a PNG, JPEG or WebP file to gray (luma of ITU-R BT.601) and sets `*frame`, which the caller frees
/// with `overfly_frame_free`. On failure `*frame` is null.
///
/// # Safety
/// `bytes` points to `length` bytes, and `frame` may be written; either may be null, which is an error.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn overfly_frame_decode(
    bytes: *const u8,
    length: usize,
    frame: *mut *mut overfly_frame,
) -> overfly_status {
    call(|| {
        let out = unsafe { Place::new(frame, "frame") }?;
        out.set(std::ptr::null_mut());
        if bytes.is_null() {
            return Err(CallError::bad_argument("bytes is null"));
        }
        if isize::try_from(length).is_err() {
            return Err(CallError::bad_argument("length is too large"));
        }
        let gray = decode_frame(unsafe { std::slice::from_raw_parts(bytes, length) }, "the frame")?;
        out.set(Box::into_raw(Box::new(overfly_frame { gray })));
        Ok(overfly_status::OVERFLY_OK)
    })
}

/// Frees a frame. Null does nothing.
///
/// # Safety
/// `frame` is null or comes from a function of this interface, and is not used afterwards.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn overfly_frame_free(frame: *mut overfly_frame) {
    if !frame.is_null() {
        release(|| drop(unsafe { Box::from_raw(frame) }));
    }
}

/// Width and height within the bounds of a decoded frame.
fn checked_size(width_px: u32, height_px: u32) -> Result<(usize, usize), CallError> {
    let FrameBounds { edge_px, pixels } = FrameBounds::default();
    let is_good = width_px.min(height_px) > 0
        && width_px.max(height_px) <= edge_px
        && u64::from(width_px) * u64::from(height_px) <= pixels;
    if !is_good {
        let text = format!("{width_px} x {height_px} px: at least 1, at most {edge_px} a side and {pixels} in all");
        return Err(CallError::bad_argument(text));
    }
    Ok((width_px as usize, height_px as usize))
}
