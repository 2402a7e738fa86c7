//! `JpegError`: why a JPEG file is refused.

/// Why a JPEG file is refused.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum JpegError {
    /// The bytes are no JPEG file.
    #[error("not a JPEG file: it does not begin with FF D8")]
    NotJpeg,
    /// A valid file of a kind that this decoder does not read.
    #[error("JPEG with {0} cannot be read")]
    Unsupported(&'static str),
    /// The file does not decode exactly.
    #[error("{damage} (segment at byte {at_byte})")]
    Damaged {
        /// Where the segment or the run of coded data begins in which the damage was found.
        at_byte: usize,
        /// What was found.
        damage: JpegDamage,
    },
}

/// What does not fit in a damaged JPEG file.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum JpegDamage {
    /// The file ends before the end of the image.
    #[error("the file ends before the image's end marker")]
    EndsEarly,
    /// Bytes that belong to no segment.
    #[error("there are bytes between the segments that belong to none")]
    StrayBytes,
    /// A marker that may not stand here.
    #[error("marker FF {0:02X} may not stand here")]
    Marker(u8),
    /// A segment whose content does not fit its kind.
    #[error("the {0} is not valid")]
    Segment(&'static str),
    /// A scan that names a table that the file does not define.
    #[error("a scan uses a {0} that is not defined")]
    MissingTable(&'static str),
    /// Bits that are no code of the table.
    #[error("the coded data hold bits that are no Huffman code")]
    Code,
    /// A block with too many coefficients.
    #[error("a block has more than 64 coefficients")]
    Index,
    /// A coefficient that pixels of 8 bits cannot have.
    #[error("a coefficient is out of the range of 8-bit pixels")]
    Range,
    /// A block full of coefficients that are those of the block before.
    #[error("the coded data are a run of equal bytes")]
    Repeated,
    /// A run of blocks without coefficients that is longer than the blocks left.
    #[error("a run of empty blocks goes on after the last block")]
    EmptyRun,
    /// The coded data end before the last block.
    #[error("the coded data end before the last block of the image")]
    DataMissing,
    /// Coded data remain after the last block.
    #[error("{0} bits of coded data remain after the last block")]
    DataLeft(usize),
    /// A restart marker is missing or out of order.
    #[error("marker FF {found:02X} stands where restart marker FF {expected:02X} is due")]
    Restart {
        /// The second byte of the marker that is due.
        expected: u8,
        /// The second byte of the marker found.
        found: u8,
    },
    /// The end of the image comes before all of its components.
    #[error("the image ends before all of its components are coded")]
    ComponentMissing,
}

impl JpegDamage {
    /// The error of this damage in the segment at a byte.
    pub(super) fn at(self, at_byte: usize) -> JpegError {
        JpegError::Damaged { at_byte, damage: self }
    }
}
