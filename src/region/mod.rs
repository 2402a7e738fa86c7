//! The drift/uncertainty region of each coupling mode as geometry on the ground.
