//! A strict JPEG decoder: bytes to gray or colour images, whole or at 1/2, 1/4, 1/8 of their size.
//!
//! A picture whose coded data were damaged often decodes without an error: the Huffman codes fall into step again after a few
//! blocks, and the rest of the picture stands some blocks beside its place. This decoder refuses a file whose bits do not
//! decode exactly: codes that no table holds, blocks of more than 64 coefficients, values that 8-bit pixels cannot have, data
//! that end before the last block or go on after it, restart markers out of order, a missing end.
//!
//! It reads 8-bit sequential and progressive files of one, three or four components with Huffman codes. It does not read
//! arithmetic coding, 12-bit, lossless and hierarchical files. Orientation tags and colour profiles are not applied.
//!
//! # References
//! ITU-T T.81 (JPEG), called T.81 below; T.871 (JFIF) for colour.

mod bits;
mod colour;
mod decode;
mod entropy;
mod error;
mod frame_header;
mod huffman;
mod inverse_transform;
mod plane;
mod progressive;
mod quantization;
mod scan_header;
mod segments;
mod sequential;
mod standard_tables;

pub use decode::{check, decode_colour, decode_gray, header};
pub use error::{JpegDamage, JpegError};
pub use frame_header::JpegHeader;
pub use plane::Reduction;
